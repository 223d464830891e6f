// What the filter as a scan costs, by running it on counting numbers (study/scan/tasks.hpp): flops
// of factors and of one acceleration on top of them, kinematics not counted. CSV:
//   family,value,n,seed,task,variant,links,depth,processors,flops
// processors 0 stands for any number: the span. flops on one processor is the work. A sequential
// filter has rows of one processor alone. Both include the test for singular mechanisms, with its second
// look at suspects (singularity.hpp, scan/singularity_scan.hpp).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "accuracy/stress/families.hpp"

namespace kalmarm::scan_cost {

inline constexpr const char* csv_header =
    "family,value,n,seed,task,variant,links,depth,processors,flops\n";

std::string rows(const stress::Family& family, double value, std::uint64_t seed,
                 const std::vector<int>& links);

}  // namespace kalmarm::scan_cost
