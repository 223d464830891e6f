// Implicit steps: their equation with M and bias of the door, closed forms of one joint, energy,
// derivatives by differences, and what is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/step_differences.hpp"
#include "kalmarm/model_builder.hpp"

namespace kalmarm::test {
namespace {

constexpr Scheme schemes[] = {Scheme::springs_at_end, Scheme::springs_at_start};

// From none to stiff, decade by decade; springs where a joint may have one.
JointTerms some_terms(const Model<double>& model, std::uint64_t seed) {
  Random random(seed);
  JointTerms out;
  for (int k = 0; k < model.nv(); ++k) {
    out.damping.push_back(k % 3 == 0 ? 0 : std::pow(10, random.uniform(-2, 4)));
    out.stiffness.push_back(is_single(model, k) && k % 4 != 1 ? std::pow(10, random.uniform(0, 6))
                                                              : 0);
    out.reference.push_back(random.uniform(-1, 1));
  }
  return out;
}

template <class T>
class ImplicitSteps : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(ImplicitSteps, Scalars);

// (2), each row beside the sizes of its terms.
TYPED_TEST(ImplicitSteps, SolveTheirEquation) {
  using T = TypeParam;
  const double h = 0.002;
  for (const Family& family : robots())
    for (const Scheme scheme : schemes)
      for (const Tolerance tolerance : tolerances) {
        const Model<double> model = rounded<T>(family.make(3));
        SCOPED_TRACE(std::string(family.name) + ' ' + name_of(tolerance));
        const int nv = model.nv();
        const RobotModel robot = plain(model);
        const JointTerms terms = some_terms(model, 7);
        const State<T> state = random_state(model, 11).template cast<T>();
        ImplicitStep<T> step(robot, h, terms, scheme, {.tolerance = tolerance});
        VectorX<T> a = poisoned<T>(nv);
        ASSERT_TRUE(step.acceleration(state.q, state.qd, state.tau, a));

        Dynamics<double> plain_robot(robot);
        const State<double> exact = state.template cast<double>();
        MatrixX<double> M(nv, nv);
        VectorX<double> bias(nv);
        plain_robot.mass(exact.q, M);
        plain_robot.bias(exact.q, exact.qd, bias);
        const VectorX<double> x = a.template cast<double>();
        for (int k = 0; k < nv; ++k) {
          const double b = terms.damping[k], s = terms.stiffness[k];
          const double at_end = scheme == Scheme::springs_at_end ? h : 0;
          const double q = s > 0 ? exact.q[robot.links[k].q_index] - terms.reference[k] : 0;
          const double spring = s * (q + at_end * exact.qd[k]);
          const double r = h * (b + at_end * s);
          const double left = M.row(k).dot(x) + r * x[k];
          const double right = exact.tau[k] - bias[k] - b * exact.qd[k] - spring;
          const double size = M.row(k).cwiseAbs().dot(x.cwiseAbs()) + std::abs(r * x[k]) +
                              std::abs(exact.tau[k]) + std::abs(bias[k]) +
                              std::abs(b * exact.qd[k]) + s * std::abs(terms.reference[k]) +
                              std::abs(spring) + 1;
          EXPECT_LE(std::abs(left - right), 2000 * unit_roundoff<T>() * size) << k;
        }
      }
}

// v+ = (v - (h k / m) (q - q0) + h f / m) / (1 + h b / m + h^2 k / m), of one slide.
TYPED_TEST(ImplicitSteps, OfOneSlideAreTheClosedForm) {
  using T = TypeParam;
  const T u = unit_roundoff<T>();
  ModelBuilder builder;
  builder.set_gravity({0, 0, 0});
  const double m = 3, b = 40, k = 1e5, h = 0.01, q0 = 0.25, f = 7;
  builder.add_body({.name = "x", .joint = JointType::slide, .mass = m});
  ImplicitStep<T> step(builder.build(), h, {{b}, {k}, {q0}});
  VectorX<T> q(1), v(1), tau(1), a(1);
  q << T(0.5);
  v << T(-2);
  tau << T(f);
  const double q_begin = 0.5, v_begin = -2;
  ASSERT_TRUE(step.step(q, v, tau, a));
  const double expected =
      (v_begin - h * k / m * (q_begin - q0) + h * f / m) / (1 + h * b / m + h * h * k / m);
  EXPECT_NEAR(v[0], expected, 20 * u * h * k / m);
  EXPECT_NEAR(q[0], q_begin + h * expected, 20 * u * h * h * k / m);
}

// M of slides alone is constant: kinetic and spring energy never grow, whatever h and k.
TYPED_TEST(ImplicitSteps, OfSpringsOnSlidesLoseEnergy) {
  using T = TypeParam;
  const Model<double> model = rounded<T>(slides_alone(5, 8));
  RobotModel robot = plain(model);
  robot.gravity = {0, 0, 0};
  const int nv = robot.nv();
  for (const double k : {1.0, 1e4, 1e8}) {
    const JointTerms terms = {{}, std::vector<double>(nv, k), {}};
    ImplicitStep<T> step(robot, 0.01, terms);
    Dynamics<double> dynamics(robot);
    State<T> state = random_state(model, 2).template cast<T>();
    const VectorX<T> none = VectorX<T>::Zero(nv);
    MatrixX<double> M(nv, nv);
    dynamics.mass(VectorX<double>(state.q.template cast<double>()), M);
    const auto energy = [&] {
      const VectorX<double> q = state.q.template cast<double>(),
                            v = state.qd.template cast<double>();
      return 0.5 * v.dot(M * v) + 0.5 * k * q.squaredNorm();
    };
    VectorX<T> a(nv);
    double before = energy();
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(step.step(state.q, state.qd, none, a));
      EXPECT_LE(energy(), before * (1 + 1000 * static_cast<double>(unit_roundoff<T>())));
      before = energy();
    }
  }
}

TYPED_TEST(ImplicitSteps, WithoutTermsAreForwardDynamics) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    const Model<double> model = rounded<T>(family.make(1));
    const State<T> state = random_state(model, 4).template cast<T>();
    VectorX<T> a = poisoned<T>(model.nv()), plain_a = a;
    ImplicitStep<T> step(plain(model), 0.01, {});
    Dynamics<T> dynamics(plain(model));
    ASSERT_TRUE(step.acceleration(state.q, state.qd, state.tau, a));
    ASSERT_TRUE(dynamics.forward_dynamics(state.q, state.qd, state.tau, plain_a));
    EXPECT_EQ(a, plain_a) << family.name;
  }
}

TYPED_TEST(ImplicitSteps, OfRowsAreThoseOfOneState) {
  using T = TypeParam;
  const Model<double> model = rounded<T>(creature(2));
  const RobotModel robot = plain(model);
  const int nv = robot.nv(), count = 21;
  ImplicitStep<T> step(robot, 0.005, some_terms(model, 1));
  using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
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
  }
}

TEST(ImplicitStepsDerivatives, AreDifferences) {
  for (const Family& family : robots())
    for (const Scheme scheme : schemes) {
      SCOPED_TRACE(family.name);
      const Model<double> model = family.make(2);
      const RobotModel robot = plain(model);
      ImplicitStep<double> step(robot, 0.002, some_terms(model, 3), scheme);
      expect_differences(robot, step, random_state(model, 6));
    }
}

// A free body that spins about its z axis at pi rad/s and moves along x: half a turn in a second.
TEST(Advance, TurnsQuaternionsByTheirAngle) {
  ModelBuilder builder;
  builder.add_body(
      {.name = "body", .joint = JointType::free, .mass = 1, .inertia = {1, 1, 1, 0, 0, 0}});
  const RobotModel robot = builder.build();
  VectorX<double> q(7), v(6), a = VectorX<double>::Zero(6);
  q << 1, 2, 3, 2, 0, 0, 0;  // of any length
  v << 0.5, 0, 0, 0, 0, std::numbers::pi;
  advance(robot, 1, a, q, v);
  const double expected[] = {1.5, 2, 3, 0, 0, 0, 1};
  for (int i = 0; i < 7; ++i) EXPECT_NEAR(q[i], expected[i], 1e-15) << i;
  v.setZero();
  const VectorX<double> before = q;
  advance(robot, 1, a, q, v);
  EXPECT_EQ(q, before);
}

TEST(ImplicitStepRefuses, WhatNoStepIs) {
  const Model<double> model = floating_base(1);
  const RobotModel robot = plain(model);
  const int nv = robot.nv();
  const auto with = [&](double x) {
    std::vector<double> out(nv, 0);
    out.back() = x;
    return out;
  };
  const auto refused = [&](double h, const JointTerms& terms, const std::string& says,
                           const DynamicsOptions& options = {}) {
    try {
      ImplicitStep<float> step(robot, h, terms, Scheme::springs_at_end, options);
      ADD_FAILURE() << says;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  };
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const std::string last = "DoF '" + robot.names.back() + "': ";
  refused(-0.01, {}, "h = -0.01");
  refused(nan, {}, "h = nan");
  refused(inf, {}, "h = inf");
  refused(0.01, {.damping = with(-1)}, last + "damping -1");
  refused(0.01, {.damping = with(nan)}, last + "damping nan");
  refused(0.01, {.stiffness = with(1e39)}, last + "stiffness 1e39");
  refused(0.01, {.stiffness = with(1), .reference = with(inf)}, last + "reference inf");
  refused(0.01, {.damping = {1}}, "damping of 1 DoF, needed " + std::to_string(nv));
  std::vector<double> on_the_base(nv, 0);
  on_the_base[4] = 1;
  refused(0.01, {.stiffness = on_the_base}, "a spring about a ball or a free joint");
  DynamicsOptions some;
  some.question.dofs = {0};
  refused(0.01, {}, "leaves joints out", some);
  some.question = {.at_rest = true};
  refused(0.01, {}, "at rest", some);

  ImplicitStep<double> step(robot, 0.01, {});
  VectorX<double> q(robot.nq), v(nv), a(nv), few(nv - 1);
  EXPECT_THROW((void)step.acceleration(q, few, v, a), std::invalid_argument);
  EXPECT_THROW((void)step.acceleration(q, v, v, few), std::invalid_argument);
  EXPECT_THROW((void)step.step(q, v, few, a), std::invalid_argument);
  EXPECT_THROW(advance(robot, 1, few, q, v), std::invalid_argument);
}

}  // namespace
}  // namespace kalmarm::test
