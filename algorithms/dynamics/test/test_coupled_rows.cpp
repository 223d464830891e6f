// Rows of implicit steps: their equation against dense matrices, closed forms of two slides, lengths
// that are imposed, derivatives by differences, and what is refused.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/step_differences.hpp"
#include "kalmarm/model_builder.hpp"

namespace kalmarm::test {
namespace {

constexpr double h = 0.002;
constexpr Scheme schemes[] = {Scheme::springs_at_end, Scheme::springs_at_start};

// Of three kinds in turn: with everything, a spring alone, a damper alone.
std::vector<CoupledRow> some_rows(const Model<double>& model, int count, std::uint64_t seed) {
  Random random(seed);
  std::vector<CoupledRow> out;
  for (int i = 0; i < count; ++i) {
    CoupledRow row;
    for (int k = 0; k < model.nv(); ++k)
      row.jacobian.push_back(
          is_single(model, k) && (k + i) % 2 == 0 ? static_cast<float>(random.uniform(-1, 1)) : 0);
    row.reference = random.uniform(-1, 1);
    if (i % 3 == 0) row.armature = 0.1;
    if (i % 3 != 1) row.damping = std::pow(10, random.uniform(-1, 3));
    if (i % 3 != 2) row.stiffness = std::pow(10, random.uniform(0, 5));
    out.push_back(row);
  }
  return out;
}

std::vector<double> dampers(const Model<double>& model) {
  std::vector<double> out;
  for (int k = 0; k < model.nv(); ++k) out.push_back(is_single(model, k) ? 0.5 : 0);
  return out;
}

// M^, and the torque that M^ a is.
struct Dense {
  MatrixX<double> M;
  VectorX<double> right;
  double size;  // of what `right` is summed from

  Dense(const RobotModel& robot, const JointTerms& terms, Scheme scheme,
        const State<double>& state) {
    const int nv = robot.nv();
    const double at_end = scheme == Scheme::springs_at_end ? h : 0;
    Dynamics<double> plain_robot(robot);
    VectorX<double> bias(nv);
    M.resize(nv, nv);
    plain_robot.mass(state.q, M);
    plain_robot.bias(state.q, state.qd, bias);
    right = state.tau - bias;
    size = state.tau.norm() + bias.norm();
    for (int k = 0; k < nv; ++k) {
      M(k, k) += h * terms.damping[k];
      right[k] -= terms.damping[k] * state.qd[k];
    }
    for (const CoupledRow& row : terms.rows) {
      const Eigen::Map<const VectorX<double>> J(row.jacobian.data(), nv);
      double length = -row.reference;
      for (int k = 0; k < nv; ++k)
        if (J[k] != 0) length += J[k] * state.q[robot.links[k].q_index];
      const double rate = J.dot(state.qd);
      const double force = row.damping * rate + row.stiffness * (length + at_end * rate);
      M += J * (row.armature + h * row.damping + h * at_end * row.stiffness) * J.transpose();
      right -= J * force;
      size += J.norm() * (row.damping * std::abs(rate) +
                          row.stiffness * (std::abs(length) + std::abs(at_end * rate)));
    }
  }
};

template <class T>
class CoupledRowsOf : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(CoupledRowsOf, Scalars);

// What is lost is a part of a0, the acceleration without rows: M^^-1 is the smaller matrix.
TYPED_TEST(CoupledRowsOf, StepsSolveTheirEquation) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (const Scheme scheme : schemes)
      for (const Tolerance tolerance : tolerances) {
        const Model<double> model = rounded<T>(family.make(3));
        SCOPED_TRACE(std::string(family.name) + ' ' + name_of(tolerance));
        const int nv = model.nv();
        const RobotModel robot = plain(model);
        const JointTerms terms = {.damping = dampers(model), .rows = some_rows(model, 5, 9)};
        const State<T> state = random_state(model, 11).template cast<T>();
        ImplicitStep<T> step(robot, h, terms, scheme, {.tolerance = tolerance});
        VectorX<T> a = poisoned<T>(nv);
        ASSERT_TRUE(step.acceleration(state.q, state.qd, state.tau, a));

        const Dense dense(robot, terms, scheme, state.template cast<double>());
        const VectorX<double> x = dense.M.ldlt().solve(dense.right);
        MatrixX<double> M(nv, nv);
        Dynamics<double>(robot).mass(VectorX<double>(state.q.template cast<double>()), M);
        const double most = M.ldlt().solve(MatrixX<double>::Identity(nv, nv)).norm() * dense.size;
        EXPECT_LE((a.template cast<double>() - x).norm(), 200 * unit_roundoff<T>() * most);
      }
}

TYPED_TEST(CoupledRowsOf, MassAndItsInverseAreThoseOfTheEquation) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(2));
    const RobotModel robot = plain(model);
    const int nv = robot.nv();
    const JointTerms terms = {.damping = dampers(model), .rows = some_rows(model, 3, 4)};
    const State<T> state = random_state(model, 5).template cast<T>();
    ImplicitStep<T> step(robot, h, terms);
    MatrixX<T> M = poisoned<T>(nv, nv), X = M, columns = M;
    step.mass(state.q, M);
    ASSERT_TRUE(step.inverse_mass(state.q, X));
    const Dense dense(robot, terms, Scheme::springs_at_end, state.template cast<double>());
    EXPECT_LE((M.template cast<double>() - dense.M).norm(),
              100 * unit_roundoff<T>() * dense.M.norm());
    const MatrixX<double> expected = dense.M.ldlt().solve(MatrixX<double>::Identity(nv, nv));
    MatrixX<double> without(nv, nv);
    Dynamics<double>(robot).mass(VectorX<double>(state.q.template cast<double>()), without);
    const double most = without.ldlt().solve(MatrixX<double>::Identity(nv, nv)).norm();
    EXPECT_LE((X.template cast<double>() - expected).norm(), 500 * unit_roundoff<T>() * most);

    // Factors are kept, also where a step comes between.
    ASSERT_TRUE(step.factor(state.q));
    const State<T> other = random_state(model, 6).template cast<T>();
    VectorX<T> a(nv);
    ASSERT_TRUE(step.acceleration(other.q, other.qd, other.tau, a));
    const MatrixX<T> unit = MatrixX<T>::Identity(nv, nv);
    ASSERT_TRUE(step.solve(unit, columns));
    EXPECT_LE((columns.template cast<double>() - expected).norm(), 500 * unit_roundoff<T>() * most);
  }
}

// Two slides, side by side: their difference moves as one mass m1 m2 / (m1 + m2), their centre of
// mass as if there were no row.
RobotModel two_slides(double m1, double m2) {
  ModelBuilder builder;
  builder.set_gravity({0, 0, 0});
  builder.add_body({.name = "x", .joint = JointType::slide, .mass = m1});
  builder.add_body({.name = "y", .joint = JointType::slide, .mass = m2});
  return builder.build();
}

TYPED_TEST(CoupledRowsOf, TwoSlidesAreTheClosedForm) {
  using T = TypeParam;
  const double m1 = 2, m2 = 6, m = m1 * m2 / (m1 + m2), k = 4e4, b = 16, w = 0.5, l0 = 0.25;
  const RobotModel robot = two_slides(m1, m2);
  const JointTerms terms = {
      .rows = {
          {.jacobian = {1, -1}, .armature = w, .damping = b, .stiffness = k, .reference = l0}}};
  ImplicitStep<T> step(robot, h, terms);
  VectorX<T> q(2), v(2), tau = VectorX<T>::Zero(2), a(2);
  q << T(1), T(0.5);
  v << T(-2), T(1);
  ASSERT_TRUE(step.acceleration(q, v, tau, a));
  const double length = 0.5 - l0, rate = -3;
  const double expected = -(b * rate + k * (length + h * rate)) / (m + w + h * b + h * h * k);
  const T u = unit_roundoff<T>();
  EXPECT_NEAR(a[0] - a[1], expected, 50 * u * std::abs(expected));
  EXPECT_NEAR(m1 * a[0] + m2 * a[1], 0, 50 * u * m * std::abs(expected));
}

TYPED_TEST(CoupledRowsOf, AnImposedLengthIsThereAfterOneStep) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(1));
    const RobotModel robot = plain(model);
    const int nv = robot.nv();
    std::vector<CoupledRow> rows = some_rows(model, 2, 5);
    for (CoupledRow& row : rows)
      row = {.jacobian = row.jacobian, .reference = 0.1, .imposed = true};
    ImplicitStep<T> step(robot, 0.01, {.rows = rows});
    State<T> state = random_state(model, 8).template cast<T>();
    VectorX<T> a(nv);
    const auto lengths = [&](const VectorX<T>& q) {
      VectorX<double> out = VectorX<double>::Zero(2);
      for (int i = 0; i < 2; ++i)
        for (int k = 0; k < nv; ++k)
          if (rows[i].jacobian[k] != 0)
            out[i] += rows[i].jacobian[k] * static_cast<double>(q[robot.links[k].q_index]);
      return out;
    };
    const double before = (lengths(state.q).array() - 0.1).abs().maxCoeff();
    ASSERT_GT(before, 0.01);
    ASSERT_TRUE(step.step(state.q, state.qd, state.tau, a));
    const double moved =
        1e-4 * static_cast<double>(a.norm()) + state.q.template cast<double>().norm();
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(lengths(state.q)[i], 0.1, 200 * unit_roundoff<T>() * moved);
    VectorX<T> M(nv * nv);
    EXPECT_THROW(step.mass(state.q, MatrixView<T>(M.data(), nv, nv)), std::logic_error);
  }
}

TYPED_TEST(CoupledRowsOf, RowsOfStatesAreThoseOfOneState) {
  using T = TypeParam;
  using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const Tolerance tolerance : tolerances) {
    const Model<double> model = rounded<T>(creature(2));
    const RobotModel robot = plain(model);
    const int nv = robot.nv(), count = 37;
    ImplicitStep<T> step(robot, h, {.rows = some_rows(model, 4, 1)}, Scheme::springs_at_end,
                         {.tolerance = tolerance, .rules = {}});
    Rows q(count, robot.nq), v(count, nv), tau(count, nv), a = poisoned<T>(count, nv);
    for (int i = 0; i < count; ++i) {
      const State<T> state = random_state(model, i).template cast<T>();
      q.row(i) = state.q;
      v.row(i) = state.qd;
      tau.row(i) = state.tau;
    }
    std::vector<Outcome> outcomes(count);
    ASSERT_EQ(step.acceleration(q, v, tau, a, outcomes, 2), 0);
    for (int i = 0; i < count; ++i) {
      VectorX<T> one = poisoned<T>(nv);
      const VectorX<T> q_i = q.row(i), v_i = v.row(i), tau_i = tau.row(i);
      ASSERT_TRUE(step.acceleration(q_i, v_i, tau_i, one));
      EXPECT_LE((one - VectorX<T>(a.row(i))).norm(), 4000 * unit_roundoff<T>() * one.norm()) << i;
      EXPECT_GE(outcomes[i].error, 0) << i;
    }
  }
}

// With rows that are imposed, that have W, and whose force is known.
TEST(CoupledRowsDerivatives, AreDifferences) {
  for (const Family& family : robots())
    for (const bool imposed : {false, true}) {
      SCOPED_TRACE(family.name);
      const Model<double> model = family.make(2);
      const RobotModel robot = plain(model);
      JointTerms terms = {.damping = dampers(model), .rows = some_rows(model, 3, 3)};
      terms.rows[0].imposed = imposed;
      const Scheme scheme = imposed ? Scheme::springs_at_end : Scheme::springs_at_start;
      ImplicitStep<double> step(robot, 0.02, terms, scheme);
      expect_differences(robot, step, random_state(model, 6));
    }
}

// A spring at the start of a step is a torque: nothing is solved for it.
TEST(CoupledRowsDerivatives, OfAKnownForceAloneAreDifferences) {
  const Model<double> model = creature(2);
  const RobotModel robot = plain(model);
  std::vector<CoupledRow> rows = {some_rows(model, 2, 3)[1]};
  ASSERT_EQ(rows[0].armature + rows[0].damping, 0);
  ImplicitStep<double> step(robot, h, {.rows = rows}, Scheme::springs_at_start);
  const State<double> state = random_state(model, 6);
  expect_differences(robot, step, state);
  MatrixX<double> M(robot.nv(), robot.nv()), plain_M = M;
  step.mass(state.q, M);
  Dynamics<double>(robot).mass(state.q, plain_M);
  EXPECT_EQ(M, plain_M);
}

TYPED_TEST(CoupledRowsOf, ImposedTwiceAreSingular) {
  using T = TypeParam;
  const RobotModel robot = two_slides(1, 3);
  const CoupledRow row = {.jacobian = {1, -1}, .imposed = true};
  CoupledRow twice = row;
  twice.jacobian = {0.3, -0.3};
  ImplicitStep<T> step(robot, h, {.rows = {row, twice}});
  VectorX<T> q = VectorX<T>::Zero(2), a(2), x(2);
  const Outcome outcome = step.acceleration(q, q, q, a);
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_LE(std::abs(outcome.D), 4 * unit_roundoff<T>() * outcome.scale);
  EXPECT_EQ(step.factor(q).status, Outcome::Status::singular);
  EXPECT_EQ(step.solve(q, x).status, Outcome::Status::singular);
  EXPECT_TRUE(std::isnan(x[0]));
}

TEST(CoupledRowsRefuse, WhatNoRowIs) {
  const Model<double> model = floating_base(1);
  const RobotModel robot = plain(model);
  const std::vector<double> none(robot.nv(), 0);
  const auto refused = [&](double step_size, const CoupledRow& row, const std::string& says) {
    try {
      ImplicitStep<float> step(robot, step_size, {.rows = {{.jacobian = none}, row}});
      ADD_FAILURE() << says;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("row 1: " + says), std::string::npos)
          << error.what();
    }
  };
  std::vector<double> on_the_base = none, bad = none;
  on_the_base[4] = 1;
  bad.back() = std::nan("");
  refused(h, {.jacobian = {1}}, "jacobian of 1 DoF, needed " + std::to_string(robot.nv()));
  refused(h, {.jacobian = on_the_base}, "couples DoF '" + robot.names[4] + "'");
  refused(h, {.jacobian = none, .armature = -1}, "armature -1");
  refused(h, {.jacobian = none, .damping = std::nan("")}, "damping nan");
  refused(h, {.jacobian = none, .stiffness = 1e39}, "stiffness 1e39");
  refused(0, {.jacobian = none, .imposed = true}, "imposed in a step of h = 0");
  EXPECT_THROW(ImplicitStep<float>(robot, h, {.rows = {{.jacobian = bad}}}), std::invalid_argument);
  EXPECT_THROW(ImplicitStep<float>(robot, h, {.rows = {{}}}), std::invalid_argument);
}

}  // namespace
}  // namespace kalmarm::test
