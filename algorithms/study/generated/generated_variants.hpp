// Generated<X>: a variant X of the study as straight-line code for one robot. Its templates run once on numbers that record
// (generate/recorded.hpp), so that all variants are compared at their best and no recursion is written a second time.
//
// What X decides by values is decided in one reference state, and the code is that of all states that decide alike:
// X asks whether a D, a weight, a length or a norm is zero before it divides. Where one of them is zero that is not zero for
// every state, the code divides by it, and the result is not a number. Zeros of all states are folded. X's test for
// singular mechanisms is not in the code: an outcome says whether the result is finite. A mechanism that X refuses
// in the reference state is refused.
//
// evaluated_variants (solver.hpp) work out the record operation by operation: for accuracy, without a compiler. Times are those
// of compiled code (benchmarks/generated_code.hpp).
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/generate/task.hpp"
#include "algorithms/study/solver.hpp"

namespace kalmarm {

struct GeneratedVariant {
  std::string name;  // such as "Generated<Sequential<UD>>"
  std::string equation;
  VariantTraits traits;
  // Of forward_dynamics, inverse_mass or solve. Constants are those of the model in double. Throws RefusedRecord.
  TaskRecord (*record)(GeneratedTask, const Model<double>&);
};

// X refuses the mechanism.
struct RefusedRecord : std::runtime_error {
  explicit RefusedRecord(const Outcome& why)
      : std::runtime_error(to_string(why.status)), outcome(why) {}
  Outcome outcome;
};

// The filter's updates first, then what it is compared with. What pivots by values, ArrayPivoted and EigenLDLT, has no code
// that is right for other states.
const std::vector<GeneratedVariant>& generated_variants();

// DoF up to which a variant is recorded: M^-1 stays below most_generated_operations (generate/package.hpp).
inline constexpr int most_recorded_dofs = 32;

}  // namespace kalmarm
