// True answers, on mechanisms whose answer is known in closed form or found in another way.
#include <gtest/gtest.h>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <cmath>

#include "accuracy/adversary/exact.hpp"
#include "robots/scene/generate.hpp"

namespace kalmarm::adversary {
namespace {

using Wide = long double;

RigidBody<double> point(double mass, const Vector3<double>& com = {0, 0, 0}) {
  return {mass, com, {1, 0, 0, 0}, {0, 0, 0}};
}

VectorX<double> values(std::initializer_list<double> x) {
  VectorX<double> out(static_cast<Eigen::Index>(x.size()));
  std::copy(x.begin(), x.end(), out.begin());
  return out;
}

// Two carts on one rail, the second on the first: M = (m1 + m2, m2; m2, m2).
Mechanism carts(double m1, double m2) {
  Joints joints(2);
  for (Joint<double>& joint : joints) {
    joint.slides = true;
    joint.coordinate = Coordinate::distance;
  }
  joints[0].body = point(m1);
  joints[1].parent = 0;
  joints[1].body = point(m2);
  return {assemble(joints, {0, 0, 0}), {values({0, 0}), values({0, 0}), values({1, 3})}};
}

// A mass m at the distance l of a hinge, whose axis is vertical, with gravity g across it:
// m l^2 a = tau - m g l cos q.
Mechanism pendulum(double m, double l, double g, double q, double tau) {
  Joint<double> hinge;
  hinge.body = point(m, {l, 0, 0});
  return {assemble({hinge}, {0, -g, 0}), {values({q}), values({2}), values({tau})}};
}

Wide entry(const Exact& exact, int matrix, int i, int j = 0) {
  return exact.answer.at(static_cast<std::size_t>(matrix))(i, j);
}

TEST(AdversaryExact, CartsHaveTheInverseOnPaper) {
  const Mechanism m = carts(2, 0.5);
  const Exact X = exact_answer<double>(Want::inverse, m, false);
  EXPECT_EQ(entry(X, 0, 0, 0), 0.5L);
  EXPECT_EQ(entry(X, 0, 0, 1), -0.5L);
  EXPECT_EQ(entry(X, 0, 1, 1), 2.5L);
  const Exact x = exact_answer<double>(Want::diagonal, m, false);
  EXPECT_EQ(entry(x, 0, 0), 0.5L);
  EXPECT_EQ(entry(x, 0, 1), 2.5L);
  const Exact log_det = exact_answer<double>(Want::log_det, m, false);  // det M = m1 m2
  EXPECT_LT(std::abs(entry(log_det, 0, 0)), 1e-25L);
  const Exact solved = exact_answer<double>(Want::solve, m, false);
  EXPECT_EQ(entry(solved, 0, 0), -1);
  EXPECT_EQ(entry(solved, 0, 1), 7);
}

TEST(AdversaryExact, SolvesForTheTorqueWithoutGravityAndVelocity) {
  const Exact x = exact_answer<double>(Want::solve, pendulum(2, 0.5, 9, 0.3, 4), false);
  EXPECT_EQ(entry(x, 0, 0), 8);
}

TEST(AdversaryExact, ThePendulumHasTheDerivativesOnPaper) {
  const double m = 2, l = 0.5, g = 8, q = 0.75;
  const Exact exact = exact_answer<double>(Want::derivatives, pendulum(m, l, g, q, 4), false);
  EXPECT_NEAR(static_cast<double>(entry(exact, 0, 0)), g / l * std::sin(q), 1e-15);
  EXPECT_EQ(entry(exact, 1, 0), 0);
  EXPECT_EQ(entry(exact, 2, 0), 2);
}

TEST(AdversaryExact, NumbersAreThoseOfThePrecision) {
  const Mechanism m = carts(1 + 0x1p-25, 1);  // float32 holds 1
  EXPECT_EQ(entry(exact_answer<float>(Want::inverse, m, false), 0, 0, 0), 1);
  EXPECT_LT(entry(exact_answer<double>(Want::inverse, m, false), 0, 0, 0), 1);
}

TEST(AdversaryExact, ConditionIsWhatAMassDoes) {
  // one cart: X = 1/m and log m move by u and u / log m
  Mechanism m = carts(1e3, 1);
  m = {assemble({m.model.joint(0)}, {0, 0, 0}), {values({0}), values({0}), values({1})}};
  for (const Want task : {Want::inverse, Want::diagonal, Want::solve}) {
    SCOPED_TRACE(to_string(task));
    const Exact exact = exact_answer<double>(task, m, true);
    EXPECT_GT(exact.kS, task == Want::solve ? 0.1 : 1 - 1e-6);  // tau moves as well
    EXPECT_LT(exact.kS, 2 + 1e-6);
  }
  EXPECT_NEAR(exact_answer<double>(Want::log_det, m, true).kS, 1 / std::log(1e3), 1e-6);
}

// Two hinges in line but for an angle: M is nearly singular, and moves with the angle.
TEST(AdversaryExact, ConditionGrowsTowardsASingularity) {
  const auto folded = [](double angle) {
    Joints joints(2);
    joints[0].body = point(1e-20, {1, 0, 0});
    joints[1].parent = 0;
    joints[1].translation = {1, 0, 0};
    joints[1].body = point(1, {1, 0, 0});
    return Mechanism{assemble(joints, {0, 0, 0}),
                     {values({0, angle}), values({0, 0}), values({1, 0})}};
  };
  for (const double angle : {1e-2, 1e-4}) {
    const Exact exact = exact_answer<double>(Want::inverse, folded(angle), true);
    EXPECT_GT(exact.kS, 0.1) << angle;  // X ~ 1 / sin^2 of the angle: relatively 2
    EXPECT_LT(exact.kS, 100) << angle;
    EXPECT_NEAR(static_cast<double>(entry(exact, 0, 0, 0)) * std::pow(std::sin(angle), 2), 1, 1e-9);
  }
}

// da/dq and da/dqd of wild mechanisms, by central differences of true accelerations, whose rounding
// to long double is |a| 2^-64 / h.
TEST(AdversaryExact, DerivativesAreThoseOfTheTrueAcceleration) {
  boost::random::mt19937_64 random(1);
  boost::random::uniform_real_distribution<double> any(0, 1);
  constexpr double h = 0x1p-30;
  int compared = 0;
  for (int i = 0; i < 200; ++i) {
    Genome genome{1 + i % most_dofs, {}};
    genome.x.resize(static_cast<std::size_t>(length_of(genome.bodies)));
    for (double& x : genome.x) x = any(random);
    const Mechanism m = decode(genome);
    if (m.model.nq() != m.model.nv()) continue;  // differences are of one entry of q a DoF
    const Exact exact = exact_answer<double>(Want::derivatives, m, false),
                a = exact_answer<double>(Want::acceleration, m, false);
    if (exact.answer.empty() || a.answer.empty()) continue;
    for (const int by : {0, 1}) {
      VectorX<double> State::*const x = by == 0 ? &State::q : &State::qd;
      const MatrixX<Wide>& A = exact.answer[by];
      MatrixX<Wide> differences(A.rows(), A.cols());
      for (int k = 0; k < m.model.nv(); ++k) {
        Mechanism more = m, less = m;
        (more.state.*x)[k] += h;
        (less.state.*x)[k] -= h;
        const Exact after = exact_answer<double>(Want::acceleration, more, false),
                    before = exact_answer<double>(Want::acceleration, less, false);
        ASSERT_FALSE(after.answer.empty() || before.answer.empty());
        differences.col(k) = (after.answer[0] - before.answer[0]) /
                             (Wide((more.state.*x)[k]) - Wide((less.state.*x)[k]));
      }
      const Wide rounding = a.answer[0].norm() * 0x1p-64L / h;
      EXPECT_LT((differences - A).norm(), 1e-4L * A.norm() + 10 * rounding) << i << ' ' << by;
    }
    ++compared;
  }
  EXPECT_GT(compared, 20);
}

TEST(AdversaryExact, TheSingularIsNotKnown) {
  Joint<double> hinge;
  hinge.body = point(1);  // on its axis
  const Mechanism m = {assemble({hinge}, {0, 0, 0}), {values({0}), values({0}), values({1})}};
  for (const Want task : tasks()) EXPECT_TRUE(exact_answer<double>(task, m, true).answer.empty());
}

TEST(AdversaryMeasure, IsThatOfTheTask) {
  const auto of = [](Want task, const Answer<Wide>& difference, const Answer<Wide>& exact) {
    return error_of(task, difference, exact);
  };
  MatrixX<Wide> x(2, 1), d(2, 1), X(2, 2), dX(2, 2);
  x << 3, 4;
  d << 0.3, 0.4;
  EXPECT_DOUBLE_EQ(of(Want::acceleration, {d}, {x}), 0.1);
  EXPECT_DOUBLE_EQ(of(Want::solve, {d}, {x}), 0.1);
  d << 0.03, 0.4;
  EXPECT_DOUBLE_EQ(of(Want::diagonal, {d}, {x}), 0.1);
  X << 4, 1, 1, 9;
  dX << 0, 0.6, 0, 0;
  EXPECT_DOUBLE_EQ(of(Want::inverse, {dX}, {X}), 0.1);
  const auto one = [](Wide value) { return MatrixX<Wide>::Constant(1, 1, value).eval(); };
  EXPECT_DOUBLE_EQ(of(Want::log_det, {one(0.2)}, {one(0.5)}), 0.2);
  EXPECT_DOUBLE_EQ(of(Want::log_det, {one(0.2)}, {one(-4)}), 0.05);
}

TEST(AdversaryMeasure, LeavesOutDerivativesThatAreNothing) {
  const auto all = [](Wide a, Wide b, Wide c) {
    Answer<Wide> out;
    for (const Wide value : {a, b, c}) out.push_back(MatrixX<Wide>::Constant(1, 1, value));
    return out;
  };
  EXPECT_DOUBLE_EQ(error_of(Want::derivatives, all(1, 0.3, 0.1), all(0.005, 3, 1)), 0.1);
  EXPECT_DOUBLE_EQ(error_of(Want::derivatives, all(1, 1, 0), all(2, 0.001, 1)), 0.5);
  EXPECT_DOUBLE_EQ(error_of(Want::derivatives, all(0, 0, 1e-9), all(2, 2, 1e-8)), 0.1);
}

TEST(AdversaryMeasure, WhatIsNoNumberIsNoSmallError) {
  const Wide none = std::numeric_limits<Wide>::quiet_NaN();
  for (const Want task : tasks()) {
    const Answer<Wide> difference(3, MatrixX<Wide>::Constant(1, 1, none)),
        exact(3, MatrixX<Wide>::Constant(1, 1, 1));
    EXPECT_FALSE(error_of(task, difference, exact) < 1e300) << to_string(task);
  }
}

}  // namespace
}  // namespace kalmarm::adversary
