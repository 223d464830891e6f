// A record (task.hpp) as the body of a C function: straight-line code, one statement a node, without a branch.
//
// The same text is for one state and for a state in every lane. What stands before it says what `number` is, and has
//   all(x)                   the constant x as a number
//   sin_cos(x, &s, &c), root(x), least(a, b), with_sign(a, b), zero_where_less(a, b, c)
// A product that one sum alone needs stands in that sum, where compilers make one operation of both. Results are
// written as soon as they are known, so that results must not overlap inputs.
#pragma once

#include <string>

#include "algorithms/generate/task.hpp"

namespace kalmarm {

// Constants in S. Every line begins with two spaces and ends.
template <class S>
std::string c_statements(const TaskRecord& record);

}  // namespace kalmarm
