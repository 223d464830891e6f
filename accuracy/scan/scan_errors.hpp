// What the order of combination does to errors: accelerations of scans, of every size of blocks and
// order, and of the sequential filters that they are made of, against truth. CSV, one answer a row:
//   family,value,n,seed,precision,task,variant,links,order,depth,forgetting,status,error
// links: of a block, 0 of a variant without blocks; depth: combinations one after another;
// forgetting: the share of blocks that do not remember what comes in (covariance_element.hpp);
// error: |da| / |a|, empty where there is none; truth is the filter in 100 digits. Parameters and state are rounded to the precision
// first and exact from there.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "accuracy/stress/families.hpp"

namespace kalmarm::scan_errors {

inline constexpr const char* csv_header =
    "family,value,n,seed,precision,task,variant,links,order,depth,forgetting,status,error\n";

// Rows of one case in float32 or float64. Tasks: random torques at rest without gravity, and
// dynamics, with gravity and velocities.
std::string rows(const stress::Family& family, double value, std::uint64_t seed,
                 const std::string& precision, const std::vector<int>& links);

}  // namespace kalmarm::scan_errors
