// What a plan costs a call, by the fast path.
#pragma once

#include "algorithms/pruning/plan.hpp"

namespace kalmarm {

// Additions, multiplications and divisions of one call for one kind of answer. Forward dynamics,
// factors and the diagonal are counted by running them; columns of M^-1 and chosen blocks are what
// their headers say, a link and column.
double flops(const Plan& plan, Want want);

}  // namespace kalmarm
