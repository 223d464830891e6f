// How wrong a variant's answer is, without saying so, on a mechanism in a state.
//
// The answer is asked of the same object that `evaluate` asks (contender.hpp). Its error (measure.hpp)
// is against multi-precision (exact.hpp), for parameters and a state that are exact as the precision
// rounds them, as in the laboratory. What the search maximises is one of two.
//
// The error:
//   log10 error           of an answer that is ok and does not warn
//   less 2 log10 kS / K   where the structured condition number (exact.hpp) is above K: rounding
//                         each parameter by u changes the answer by u kS, as where torque and
//                         gravity cancel, or where torques are those of a stiff direction
//   less 2 log10 s / |a|  where an acceleration is below s, 0.01 rad/s^2 or m/s^2: beside gravity
//                         that is nothing, and an error in it is none
//   below `told`          of an answer that warns or was refused, the higher the nearer it is to
//                         the border: by D against its scale, or by the estimate of the error
//
// The claim, of an answer that is ok and does not warn:
//   log10 error / Outcome::error    of one that comes with its error; nothing is taken off, since
//                                   the claim is about the rounded mechanism, however sensitive
//                                   the parameters are. A claim below u counts as u, to which the
//                                   answer is rounded
//   log10 error / promise           of any other, less the same as above; the promise is 1e-2 in
//                                   float32 and 1e-6 in float64
#pragma once

#include <limits>
#include <memory>
#include <string>

#include "accuracy/adversary/genome.hpp"
#include "accuracy/adversary/measure.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm::adversary {

inline constexpr double usual_condition = 1e3;  // K
inline constexpr double smallest = 0.01;        // s
inline constexpr double told = -20;             // log10: no silent error is below
inline constexpr double nothing = -1e3;         // there is no truth to compare with

enum class Goal { error, claim };

constexpr const char* to_string(Goal goal) { return goal == Goal::error ? "error" : "claim"; }

// What is asked of whom, and what the search maximises.
struct Case {
  std::string variant, precision;  // float32 or float64
  Want task = Want::acceleration;
  Goal goal = Goal::error;
  Kernel kernel = Kernel::spatial;  // by which; a variant without it answers by its spatial one
  bool rows = false;                // the state is one of many rows, accelerations alone
};

// The error that is promised of every answer that does not warn.
double promise(const std::string& precision);

struct Verdict {
  Outcome outcome;                                           // of the variant
  double error = std::numeric_limits<double>::quiet_NaN();   // 1e300: larger, or no number
  double excess = std::numeric_limits<double>::quiet_NaN();  // error over what is claimed
  double kS = std::numeric_limits<double>::quiet_NaN();      // empty where nothing depends on it
  double size = std::numeric_limits<double>::quiet_NaN();    // |a|, of accelerations alone
  bool known = true;  // false: no truth within the digits, or it is zero; the above are empty

  bool silent() const { return outcome && !outcome.warns(); }
  bool claims() const;                      // comes with its error
  double value(Goal goal, double K) const;  // what the search maximises
};

// Of a known difference from the exact answer, which is not empty. brought: |gravity| + |qd|^2.
Verdict verdict_of(const Case& asked, const Outcome& outcome, const Answer<long double>& difference,
                   const Answer<long double>& exact, double kS, double brought);

class Judge {
 public:
  virtual ~Judge() = default;

  // Without truth where the variant's own outcome decides: error and kS are empty then.
  virtual Verdict look(const Mechanism& mechanism) = 0;

  // The kernel that answers.
  virtual Kernel kernel(const Mechanism& mechanism) = 0;
};

// Throws InputError where the variant is unknown or has no such precision, or does not answer what
// is asked.
std::unique_ptr<Judge> make_judge(const Case& asked);

}  // namespace kalmarm::adversary
