// Derivatives of forward dynamics as a user asks for them, and a mechanism of many tiles.
#pragma once

#include <gtest/gtest.h>

#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {

template <class T>
Outcome derivatives(const Model<double>& model, const State<T>& state,
                    AccelerationDerivatives<T>& out) {
  return dynamics_of<T>(model, spatial({Want::derivatives}))
      .derivatives(state.q, state.qd, state.tau, {.dq = out.dq, .dqd = out.dqd, .dtau = out.dtau},
                   out.a);
}

template <class T>
AccelerationDerivatives<T> derivatives(const Model<double>& model, const State<T>& state) {
  AccelerationDerivatives<T> out(model.nv());
  EXPECT_TRUE(derivatives(model, state, out));
  return out;
}

// A chain that goes through tiles, the last of which is not full.
inline Model<double> long_chain(std::uint64_t seed, int n) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < n; ++k) {
    Joint<double> joint =
        random_joint(random, k - 1, random.chance(0.3) ? Coordinate::distance : Coordinate::angle);
    if (random.chance(0.4)) joint.r = random.uniform(0.01, 0.1);
    builder.add(joint);
  }
  return builder.build();
}

}  // namespace kalmarm::test
