// One mechanism, one precision: every variant against truth, on every task.
//   random      tau ~ N(0,1), at rest, without gravity
//   white       white innovations: each joint is driven on its own scale
//   consistent  tau = M a with a ~ N(0,1), rounded: whatever kappa(M) costs, it costs here
//   free_fall   gravity, at rest, tau = 0
//   dynamics    gravity, velocities ~ N(0,1), tau ~ N(0,1)
//   inverse     M^-1
//   factors     D and g of the filters, and the health of P+
// Parameters and position are rounded to the precision first and exact from there. Outputs hold NaN
// before every call.
//
// A record is one line of CSV:
//   family,value,n,seed,precision,task,kappa,kappa_scaled,kS,variant,status,warning,relative,energy,
//   componentwise,backward,oettli_prager,eta,estimate,unrefined,steps,widened,P_min,P_constraint,
//   P_asymmetry
// The measures are those of measures.hpp, to four digits. Of a matrix, componentwise is the scaled
// error and backward |M X - 1|; of factors, relative is D's error and componentwise g's. warning:
// near_singular, or inaccurate where the variant's own estimate says 1 per cent or more. unrefined:
// relative of the variant inside Refined<>. steps and widened: as in Outcome. P_min: least over
// largest eigenvalue of P+, P_constraint |HP+| / |P+| where r = 0, P_asymmetry |P+ - P+'| / |P+|;
// the worst over all joints.
//
// A campaign counts records instead (tally.hpp). It asks for accelerations alone, of which truth
// takes a sixth of the time (acceleration_truth.hpp); M^-1 and so kappa are not known then.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "accuracy/measures/measures.hpp"
#include "accuracy/stress/families.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm::stress {

inline constexpr const char* csv_header =
    "family,value,n,seed,precision,task,kappa,kappa_scaled,kS,variant,status,warning,relative,"
    "energy,componentwise,backward,oettli_prager,eta,estimate,unrefined,steps,widened,P_min,"
    "P_constraint,P_asymmetry\n";

inline const std::vector<std::string> acceleration_tasks = {"random", "white", "consistent",
                                                            "free_fall", "dynamics"};

struct Selection {
  std::vector<std::string> variants;  // empty: all
  std::vector<std::string> tasks;     // empty: all
  bool matrices = true;               // false: accelerations alone
};

inline constexpr double none = std::numeric_limits<double>::quiet_NaN();

// Of one variant's answer to one task. NaN: does not apply.
struct Record {
  std::string task, variant;
  Outcome outcome = {};
  double kS = none;  // of the task, whatever the outcome
  double relative = none, energy = none, componentwise = none, backward = none,
         oettli_prager = none, eta = none, unrefined = none;
  double told = none;  // the error as Outcome::error of refined answers has it (measures.hpp)
  double P_min = none, P_constraint = none, P_asymmetry = none;
};

struct Measurement {
  int nv = 0;
  Outcome truth = {};  // not ok: there is no answer, and no error
  Condition condition{none, none};
  std::vector<Record> records = {};
};

// `precision` is float32 or float64. Throws NoTruth.
Measurement measure_case(const Case& c, std::uint64_t seed, const std::string& precision,
                         const Selection& selection);

// The records as lines.
std::string csv_rows(const Family& family, double value, std::uint64_t seed,
                     const std::string& precision, const Measurement& measured);

}  // namespace kalmarm::stress
