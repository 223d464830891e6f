// What the filter as a scan costs, by running it on counting numbers (study/scan/tasks.hpp): flops
// of factors and of one acceleration on top of them, kinematics not counted. CSV:
//   family,value,n,seed,task,variant,links,depth,processors,flops
// processors 0 stands for any number: the span. flops on one processor is the work. A sequential
// filter has rows of one processor alone. Neither includes the second look at suspects for
// singularity (singularity.hpp), which both do in the same way, one link after another.
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
