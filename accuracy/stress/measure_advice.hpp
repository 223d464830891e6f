// One mechanism: what the advisor chooses (accuracy/contenders/advice.hpp), and what that costs against truth.
//   dynamics    gravity, velocities and tau ~ N(0,1): |da| / |a|
//   inverse     M^-1, scaled by its diagonal
// Parameters and state are exact in float64. A record is one line of CSV:
//   family,value,n,seed,task,tolerance,variant,precision,predicted,enough,error
// error is infinite where the mechanism has no truth, or the chosen variant no answer. An answer is
// silent where it is said to be enough and its error is beyond the tolerance.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "accuracy/stress/families.hpp"

namespace kalmarm::stress {

inline constexpr const char* advice_header =
    "family,value,n,seed,task,tolerance,variant,precision,predicted,enough,error\n";

// The records of one case. Throws NoTruth.
std::string measure_advice(const Family& family, double value, std::uint64_t seed,
                           const std::vector<double>& tolerances);

}  // namespace kalmarm::stress
