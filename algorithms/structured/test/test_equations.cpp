// The fast path's equations without rounding, in a file of its own: a compiler with sanitizers
// takes minutes for its sweeps on multi-precision numbers.
#include <gtest/gtest.h>

#include "algorithms/structured/test/support.hpp"

namespace kalmarm::test {
namespace {

TEST(StructuredDynamics, EquationsHoldInMultiPrecision) {
  for (const Family& family : all_families()) {
    const Model<double> drawn = family.make(3);
    const Model<Mp> model = drawn.cast<Mp>();
    const State<Mp> state = random_state(drawn, 4).cast<Mp>();
    const StructuredModel<Mp> structured(model);
    StructuredWorkspace<Mp> ws(structured);
    VectorX<Mp> a = poisoned<Mp>(model.nv());
    structured_acceleration(structured, state.q.data(), state.qd.data(), state.tau.data(), ws,
                            a.data());
    EXPECT_LE(Truth(model, state).error(a), 1e-40) << family.name;
  }
}

}  // namespace
}  // namespace kalmarm::test
