// Coordinates of a motion: what moves, turns and measures them, against quaternions by hand.
#include <gtest/gtest.h>

#include "accuracy/motion/test/oscillator.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::motion {
namespace {

VectorX<long double> some_q() {
  VectorX<long double> q(7);
  q << 0.5L, -1, 2, 0.5L, -0.5L, 0.7L, 0.1L;
  q.tail<4>().normalize();
  return q;
}

TEST(Coordinates, DifferenceIsWhatMoved) {
  const RobotModel robot = tumbling(1).robot;
  VectorX<double> u(6);
  u << 0.1, -0.2, 0.3, 0.4, 1.1, -0.8;
  const VectorX<double> q = some_q().cast<double>();
  VectorX<double> moved = q;
  move(robot, 0.5, u, moved);
  const VectorX<long double> d =
      difference(robot, moved.cast<long double>(), q.cast<long double>());
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(static_cast<double>(d[k]), 0.5 * u[k], 1e-15) << k;
}

// Q and -Q are one orientation.
TEST(Coordinates, DifferenceKnowsNoSignOfAQuaternion) {
  const RobotModel robot = tumbling(1).robot;
  VectorX<long double> other = some_q();
  other.tail<4>() *= -1;
  EXPECT_LE(difference(robot, other, some_q()).norm(), 1e-18L);
}

// (3) of motion.hpp against a difference of Q (+) u(t), large and small u.
TEST(Coordinates, RateIsThatOfTheCurve) {
  const RobotModel robot = tumbling(1).robot;
  for (const double size : {1e-3, 0.03, 1.0, 2.5}) {
    VectorX<double> u(6), v(6), rate_u(6);
    u << 0, 0, 0, 0.5 * size, -0.7 * size, 0.4 * size;
    v << 1, 2, 3, -0.4, 0.9, 1.3;
    rate(robot, u, v, rate_u);
    const double h = 1e-5;
    VectorX<double> before = VectorX<double>::Zero(7), after;
    before[3] = 1;
    after = before;
    move<double>(robot, 1, u - h * rate_u, before);
    move<double>(robot, 1, u + h * rate_u, after);
    const VectorX<long double> d =
        difference(robot, after.cast<long double>(), before.cast<long double>());
    for (int k = 0; k < 6; ++k)
      EXPECT_NEAR(static_cast<double>(d[k]) / (2 * h), v[k], 1e-9) << size << ' ' << k;
  }
}

// Errors are relative: of a turn of 0.002 rad beside |q| = sqrt(5.25 + 1), and of v.
TEST(Errors, AreThoseOfTheirDefinition) {
  const RobotModel robot = tumbling(1).robot;
  const VectorX<long double> q = some_q(), v = VectorX<long double>::Constant(6, 2);
  VectorX<double> turned = q.cast<double>(), u = VectorX<double>::Zero(6);
  u[4] = 0.002;
  move<double>(robot, 1, u, turned);
  VectorX<long double> other_v = v;
  other_v[0] += 0.01L;
  const Errors error = errors(robot, turned.cast<long double>(), other_v, q, v);
  EXPECT_NEAR(error.q, 0.002 / std::sqrt(6.25), 1e-15);
  EXPECT_NEAR(error.v, 0.01 / std::sqrt(24.0), 1e-15);
}

TEST(Steps, DivideTheDurationOrAreRefused) {
  EXPECT_EQ(steps_of(0.5, 0.002), 250);
  EXPECT_EQ(steps_of(0.5, 1e-5), 50'000);
  EXPECT_THROW(steps_of(0.5, 0.003), InputError);
  EXPECT_THROW(steps_of(0.5, 1), InputError);
  EXPECT_THROW(steps_of(0.5, -0.1), InputError);
  EXPECT_THROW(steps_of(0.5, NAN), InputError);
}

// b = 2 zeta sqrt(k M(k,k)) at home; a free base has no springs and no dampers.
TEST(MadeMotion, HasTheDampingRatioThatWasAskedFor) {
  const Scene g1 = load_scene("g1");
  const Motion motion = make_motion(g1, {.stiffness = 400, .damping_ratio = 0.5});
  Dynamics<double> dynamics(motion.robot);
  MatrixX<double> M(motion.robot.nv(), motion.robot.nv());
  dynamics.mass(home_position(g1), M);
  for (int k = 0; k < motion.robot.nv(); ++k) {
    const bool sprung = takes_spring(motion.robot.links[k]);
    EXPECT_EQ(motion.terms.stiffness[k], sprung ? 400 : 0) << k;
    EXPECT_DOUBLE_EQ(motion.terms.damping[k], sprung ? 20 * std::sqrt(M(k, k)) : 0) << k;
    const double at = sprung ? motion.q[motion.robot.links[k].q_index] : 0;
    EXPECT_EQ(motion.terms.reference[k], at) << k;
  }
  const Motion same = make_motion(g1, {.stiffness = 400, .damping = 7});
  EXPECT_EQ(same.terms.damping.back(), 7);
  EXPECT_EQ(same.q, motion.q);
  EXPECT_NE(make_motion(g1, {.seed = 2}).q, motion.q);
}

}  // namespace
}  // namespace kalmarm::motion
