// How wrong a variant's answer is, without saying so, on a mechanism in a state.
//
// The answer is an acceleration, asked of the same object that `evaluate` asks (contender.hpp). Its
// error is |da| / |a| (measures.hpp) against multi-precision (truth.hpp), for parameters and a state
// that are exact as the precision rounds them, as in the laboratory. What the search maximises:
//
//   log10 |da| / |a|      of an answer that is ok and does not warn
//   less 2 log10 kS / K   where the structured condition number (structured_condition.hpp) is above
//                         K: rounding each parameter by u changes the answer by u kS, as where
//                         torque and gravity cancel, or where torques are those of a stiff direction
//   less 2 log10 s / |a|  where |a| is below s, 0.01 rad/s^2 or m/s^2: beside gravity that is nothing,
//                         and an error in it is none
//   below `told`          of an answer that warns or was refused, the higher the nearer it is to
//                         the border: by D against its scale, or by the estimate of the error
#pragma once

#include <limits>
#include <memory>
#include <string>

#include "accuracy/adversary/genome.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm::adversary {

inline constexpr double usual_condition = 1e3;  // K
inline constexpr double smallest = 0.01;        // s
inline constexpr double told = -20;             // log10: no silent error is below
inline constexpr double nothing = -1e3;         // there is no truth to compare with

struct Verdict {
  Outcome outcome;                                          // of the variant
  double error = std::numeric_limits<double>::quiet_NaN();  // 1e300: larger, or no number
  double kS = std::numeric_limits<double>::quiet_NaN();
  double size = std::numeric_limits<double>::quiet_NaN();  // |a|
  bool known = true;  // false: no truth within the digits, or it is zero; the above are empty

  bool silent() const { return outcome && !outcome.warns(); }
  double value(double K) const;  // what the search maximises
};

class Judge {
 public:
  virtual ~Judge() = default;

  // Without truth where the variant's own outcome decides: error and kS are empty then.
  virtual Verdict look(const Mechanism& mechanism) = 0;
};

// precision: float32 or float64. Throws InputError where the variant is unknown or has no such
// precision.
std::unique_ptr<Judge> make_judge(const std::string& variant, const std::string& precision);

}  // namespace kalmarm::adversary
