// Derivatives of implicit steps against differences of their accelerations.
#pragma once

#include <gtest/gtest.h>

#include "algorithms/dynamics/test/door_support.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm::test {

// Along a motion of each DoF, which `advance` makes: of balls and free joints too.
inline void expect_differences(const RobotModel& robot, ImplicitStep<double>& step,
                               const State<double>& state) {
  const int nv = robot.nv();
  MatrixX<double> dq(nv, nv), dv(nv, nv), dtau(nv, nv), dq_alone(nv, nv);
  VectorX<double> a(nv), less(nv), more(nv);
  ASSERT_TRUE(step.derivatives(state.q, state.qd, state.tau, {dq, dv, dtau}, a));
  ASSERT_TRUE(step.derivatives(state.q, state.qd, state.tau, {.dq = dq_alone}, a));
  EXPECT_EQ(dq, dq_alone);
  const double e = 1e-6;
  const auto expect_column = [&](const MatrixX<double>& by, int k, const auto& moved) {
    moved(e, more);
    moved(-e, less);
    const VectorX<double> difference = (more - less) / (2 * e);
    EXPECT_LE((by.col(k) - difference).norm(), 1e-6 * (1 + by.norm() + a.norm())) << k;
  };
  for (int k = 0; k < nv; ++k) {
    expect_column(dq, k, [&](double by, VectorX<double>& out) {
      VectorX<double> q = state.q, v = VectorX<double>::Zero(nv);
      advance(robot, 1, VectorX<double>(by * VectorX<double>::Unit(nv, k)), q, v);
      ASSERT_TRUE(step.acceleration(q, state.qd, state.tau, out));
    });
    expect_column(dv, k, [&](double by, VectorX<double>& out) {
      const VectorX<double> v = state.qd + by * VectorX<double>::Unit(nv, k);
      ASSERT_TRUE(step.acceleration(state.q, v, state.tau, out));
    });
    expect_column(dtau, k, [&](double by, VectorX<double>& out) {
      const VectorX<double> tau = state.tau + by * VectorX<double>::Unit(nv, k);
      ASSERT_TRUE(step.acceleration(state.q, state.qd, tau, out));
    });
  }
}

}  // namespace kalmarm::test
