#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <string>

#include "accuracy/measures/measures.hpp"
#include "accuracy/measures/real.hpp"
#include "accuracy/truth/truth.hpp"
#include "accuracy/truth/udu.hpp"
#include "algorithms/study/solver.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm {
namespace {

using test::Builder;
using test::Random;
using test::State;

// Full dynamics: one task.
template <class T>
Truth<T> truth_at(const Model<double>& model, const State<double>& state,
                  const TruthOptions& options = {}) {
  const State<T> s = state.template cast<T>();
  return truth<T>(model.cast<T>(), s.q, {{s.tau, s.qd}}, options);
}

Joint<double> planar_joint(int parent, double length, double mass, double com, double moment) {
  Joint<double> joint;
  joint.parent = parent;
  joint.translation = {length, 0, 0};
  joint.body = {mass, {com, 0, 0}, {1, 0, 0, 0}, {moment, moment, moment}};
  return joint;
}

// The arm of the textbooks in a vertical plane; the parameters are those that T rounds to.
template <class T>
void expect_two_link_closed_form() {
  Builder builder;
  builder.add(planar_joint(-1, 0, 2.3, 0.37, 0.11));
  builder.add(planar_joint(0, 0.7, 1.1, 0.29, 0.07));
  const Model<double> model = builder.build({0, -9.81, 0});
  const State<double> state = test::random_state(model, 3);
  const auto t = truth_at<T>(model, state);
  ASSERT_TRUE(t.outcome);

  const Digits digits(t.digits);
  const State<Real> s = state.cast<T>().template cast<Real>();
  const Model<Real> exact = model.cast<T>().template cast<Real>();
  const RigidBody<Real>& b1 = exact.joint(0).body;
  const RigidBody<Real>& b2 = exact.joint(1).body;
  const Real c1 = b1.com[0], c2 = b2.com[0], l = exact.joint(1).translation[0],
             gravity = -exact.gravity()[1];
  const Real cross = b2.mass * l * c2, inner = b1.mass * c1 + b2.mass * l, outer = b2.mass * c2;
  const Real cosine = cos(s.q[1]), h = cross * sin(s.q[1]);
  MatrixX<Real> M(2, 2);
  M(1, 1) = b2.moments[2] + b2.mass * c2 * c2;
  M(0, 1) = M(1, 0) = M(1, 1) + cross * cosine;
  M(0, 0) = M(1, 1) + 2 * cross * cosine + b1.moments[2] + b1.mass * c1 * c1 + b2.mass * l * l;
  VectorX<Real> torque(2);
  torque[1] = s.tau[1] - h * s.qd[0] * s.qd[0] - gravity * outer * cos(s.q[0] + s.q[1]);
  torque[0] = s.tau[0] + h * s.qd[1] * (2 * s.qd[0] + s.qd[1]) -
              gravity * (inner * cos(s.q[0]) + outer * cos(s.q[0] + s.q[1]));
  const Real det = M(0, 0) * M(1, 1) - M(0, 1) * M(0, 1);
  MatrixX<Real> X(2, 2);
  X << M(1, 1) / det, -M(0, 1) / det, -M(0, 1) / det, M(0, 0) / det;
  const VectorX<Real> a = X * torque;

  EXPECT_LT(matrix_error(t.M, M).scaled, 1e-35);
  EXPECT_LT(matrix_error(t.X, X).scaled, 1e-35);
  EXPECT_LT(acceleration_error(t.responses[0].a, a, M).relative, 1e-35);
}

TEST(Truth, TwoLinkArmHasItsClosedFormInFloat) { expect_two_link_closed_form<float>(); }
TEST(Truth, TwoLinkArmHasItsClosedFormInDouble) { expect_two_link_closed_form<double>(); }

// Euler's equations: J w' = -w x J w in the body, and its centre of mass falls with gravity.
TEST(Truth, FreeBodyFallsAndTumbles) {
  Joint<double> joint;
  joint.body = {3.0, Vector3<double>::Zero(), {1, 0, 0, 0}, {0.2, 0.3, 0.45}};
  Builder builder;
  builder.add_free(joint);
  const Model<double> model = builder.build({0.25, 0.5, -9.75});
  State<double> state = test::random_state(model, 5);
  state.tau.setZero();
  const auto t = truth_at<double>(model, state);
  ASSERT_TRUE(t.outcome);

  const Digits digits(t.digits);
  const Vector3<Real> w = state.qd.tail<3>().cast<Real>(), J = joint.body.moments.cast<Real>();
  VectorX<Real> expected(6);
  expected.head<3>() = model.gravity().cast<Real>();
  expected.tail<3>() = -w.cross(Vector3<Real>(J.cwiseProduct(w))).cwiseQuotient(J);
  EXPECT_LT(acceleration_error(t.responses[0].a, expected, t.M).relative, 1e-35);
}

// With p = sqrt(I_cm): D -> (1/2 + p)^2, and 1/D is M^-1 at the base; lambda_min(M) -> I_cm / 4;
// kappa -> 3.825 N^4.
TEST(Truth, StraightChainHasItsClosedForms) {
  struct Row {
    int links;
    double kappa_over_N4, D_bound, lambda_bound;
  };
  for (const Row& row :
       {Row{4, 4.15, 1e-3, 0.5}, Row{64, 3.94, 1e-35, 3e-3}, Row{160, 3.87, 1e-35, 4e-4}}) {
    SCOPED_TRACE(row.links);
    const int n = row.links;
    const Model<double> model = test::straight_chain(n);
    const VectorX<double> zero = VectorX<double>::Zero(n);
    const auto t = truth<double>(model, zero, {{VectorX<double>::Ones(n), zero}});
    ASSERT_TRUE(t.outcome);

    const Digits digits(t.digits);
    const Real I = 1.015 / 12, p = sqrt(I), D = (p + 0.5) * (p + 0.5);
    EXPECT_LT(static_cast<double>(Real(abs(1 - t.X(0, 0) * D))), row.D_bound);
    const Eigen::SelfAdjointEigenSolver<MatrixX<double>> X(t.X.cast<double>(),
                                                           Eigen::EigenvaluesOnly);
    const double lambda_min = 1 / X.eigenvalues().maxCoeff();
    EXPECT_NEAR(lambda_min / (1.015 / 48), 1, row.lambda_bound);
    EXPECT_NEAR(condition(t.M, t.X).kappa / std::pow(n, 4), row.kappa_over_N4, 0.005);
  }
}

class EveryMechanism : public testing::TestWithParam<test::Family> {};

TEST_P(EveryMechanism, HasOneTruthInAllAlgorithms) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const Model<double> model = GetParam().make(seed);
    const State<double> state = test::random_state(model, seed);
    const auto t = truth_at<double>(model, state);
    ASSERT_TRUE(t.outcome);
    EXPECT_LE(t.largest_width(), 1e-25);

    const Digits digits(t.digits);
    const State<Real> s = state.cast<Real>();
    VectorX<Real> a(model.nv());
    MatrixX<Real> X(model.nv(), model.nv());
    for (const RegisteredVariant<Real>& variant : registered_variants<Real>()) {
      SCOPED_TRACE(variant.name);
      const auto solver = variant.make(model.cast<Real>());
      ASSERT_TRUE(solver->acceleration(s.q, s.qd, s.tau, a));
      EXPECT_LT(acceleration_error(a, t.responses[0].a, t.M).energy, 1e-25);
      ASSERT_TRUE(solver->inverse(s.q, X));
      EXPECT_LT(matrix_error(X, t.X).scaled, 1e-25);
      if (!solver->has_factors()) continue;
      VectorX<Real> D(model.nv());
      MatrixX<Real> g(6, model.nv());
      ASSERT_TRUE(solver->factors(s.q, D, g));
      const FactorError e = factor_error(D, g, t.D, t.g);
      EXPECT_LT(e.D, 1e-25);
      EXPECT_LT(e.g, 1e-25);
    }
    EXPECT_LT(acceleration_error(UDU<Real>(t.M).D, t.D, t.M).componentwise, 1e-25);
  }
}

INSTANTIATE_TEST_SUITE_P(Families, EveryMechanism, testing::ValuesIn(test::families()),
                         [](const auto& info) { return std::string(info.param.name); });

double relative_error(const VectorX<Real>& a, const VectorX<Real>& b) {
  return quotient((a - b).norm(), b.norm());
}

TEST_P(EveryMechanism, HasOneTruthForEveryTask) {
  const Model<double> model = GetParam().make(4);
  const int nv = model.nv();
  Random random(5);
  const VectorX<double> q = test::random_state(model, 4).q, zero = VectorX<double>::Zero(nv);
  std::vector<Task<double>> tasks;
  for (const Drive drive : {Drive::torque, Drive::acceleration, Drive::innovations})
    for (const bool gravity : {false, true})
      for (const VectorX<double>& qd : {zero, random.vector(nv)})
        tasks.push_back({random.vector(nv), qd, drive, gravity});
  const auto all = truth(model, q, tasks);
  ASSERT_TRUE(all.outcome);
  const auto linear = truth(model, q, tasks, {.matrices = false});
  ASSERT_TRUE(linear.outcome);
  EXPECT_EQ(linear.M.size() + linear.X.size() + linear.D.size() + linear.g.size(), 0);

  const Digits digits(all.digits);
  Model<double> weightless = model;
  weightless.set_gravity(Vector3<double>::Zero());
  const UDU<Real> factors(all.M);
  const MatrixX<Real> root = factors.U * factors.D.cwiseSqrt().asDiagonal();  // (I + K) sqrt(D)
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    SCOPED_TRACE(i);
    const Task<double>& task = tasks[i];
    const Response<double>& response = all.responses[i];
    EXPECT_EQ(linear.responses[i].tau, response.tau);
    EXPECT_LT(relative_error(linear.responses[i].a, response.a), 1e-25);

    // the same torque, given, one task alone, gravity by the model
    const auto one = truth<double>(task.gravity ? model : weightless, q, {{response.tau, task.qd}});
    EXPECT_LT(relative_error(one.responses[0].a, response.a), 1e-25);

    const VectorX<double> ones = VectorX<double>::Ones(nv);
    const auto pushed = truth<double>(task.gravity ? model : weightless, q, {{ones, task.qd}});
    const VectorX<Real> bias = ones.cast<Real>() - all.M * pushed.responses[0].a,
                        value = task.value.cast<Real>();
    const VectorX<Real> tau = task.drive == Drive::torque         ? value
                              : task.drive == Drive::acceleration ? all.M * value + bias
                                                                  : root * value + bias;
    EXPECT_LE(acceleration_error(response.tau, tau, all.M).componentwise, 0x1p-53);
  }
}

TEST(Truth, LongChainNeedsNoMatrices) {
  const Model<double> model = test::chain(1, 200);
  const auto state = test::random_state(model, 1);
  const auto linear = truth_at<double>(model, state, {.matrices = false});
  const auto full = truth_at<double>(model, state);
  ASSERT_TRUE(linear.outcome && full.outcome);
  const Digits digits(full.digits);
  EXPECT_LT(relative_error(linear.responses[0].a, full.responses[0].a), 1e-25);
}

TEST(Truth, TorqueBeyondTheRangeThrows) {
  const Model<double> model = test::chain(1);
  const VectorX<float> q = test::random_state(model, 1).q.cast<float>(),
                       huge = VectorX<float>::Constant(12, 3e38f), zero = VectorX<float>::Zero(12);
  const std::vector<Task<float>> tasks{{huge, zero, Drive::acceleration}};
  try {
    (void)truth(model.cast<float>(), q, tasks);
    FAIL() << "no exception";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("beyond the range"), std::string::npos) << e.what();
  }
}

// More joints than the six that hold a tip by themselves: a heavy one hides the inertia of the
// others.
Model<double> chain_with_tip(double tip_mass, const Vector3<double>& gravity = {0, 0, -9.81},
                             double moments = 1) {
  Random random(7);
  Builder builder;
  for (int k = 0; k < 8; ++k) {
    Joint<double> joint = test::random_joint(random, k - 1);
    if (k == 7) {
      joint.body.moments *= moments * tip_mass / joint.body.mass;
      joint.body.mass = tip_mass;
    }
    builder.add(joint);
  }
  return builder.build(gravity);
}

// The digits to start with do not see moments.
Model<double> chain_with_flywheel(double moments, const Vector3<double>& gravity = {0, 0, -9.81}) {
  return chain_with_tip(1, gravity, moments);
}

TEST(Truth, DigitsGrowUntilTheyAreProven) {
  for (const double moments : {1e24, 1e60})
    for (const bool matrices : {false, true}) {
      const Model<double> model = chain_with_flywheel(moments);
      const auto t = truth_at<double>(model, test::random_state(model, 1), {.matrices = matrices});
      ASSERT_TRUE(t.outcome);
      EXPECT_GT(t.digits, 80u);
      EXPECT_LE(t.largest_width(), 1e-25);
    }
}

// Nothing accelerates, so that the acceleration is proven at once.
TEST(Truth, DigitsGrowUntilTheInverseIsProven) {
  const Model<double> model = chain_with_flywheel(1e24, Vector3<double>::Zero());
  State<double> state = test::random_state(model, 1);
  state.qd.setZero();
  state.tau.setZero();
  const auto t = truth_at<double>(model, state);
  ASSERT_TRUE(t.outcome);
  EXPECT_TRUE(t.responses[0].a.isZero(0));
  EXPECT_EQ(t.responses[0].width.componentwise, 0);
  EXPECT_GT(t.digits, 80u);
}

// Radii that grew by a factor a link would take hundreds of digits.
TEST(Truth, DigitsDoNotGrowWithLength) {
  const Model<double> model = test::chain(1, 1000);
  const auto t = truth_at<double>(model, test::random_state(model, 1), {.matrices = false});
  ASSERT_TRUE(t.outcome);
  EXPECT_LE(t.digits, 60u);
}

TEST(Truth, WhatIsNotProvenWithinTheLimitThrows) {
  const Model<double> model = chain_with_tip(1e60);
  EXPECT_THROW((void)truth_at<double>(model, test::random_state(model, 1), {.digits = 60}),
               std::runtime_error);
}

TEST(Truth, MasslessLastBodyIsSingular) {
  const Model<double> model = chain_with_tip(0);
  const auto t = truth_at<double>(model, test::random_state(model, 1));
  EXPECT_EQ(t.outcome.status, Outcome::Status::singular);
  EXPECT_EQ(t.outcome.joint, 7);
  EXPECT_EQ(t.X.size(), 0);
}

// Seven hinges hold a point, which three can place.
TEST(Truth, TooManyJointsOfAPointAreSingular) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    Builder builder;
    for (int k = 0; k < 7; ++k) {
      Joint<double> joint = test::random_joint(random, k - 1);
      if (k == 6) joint.body.moments.setZero();
      if (k < 6) joint.body.mass = 0, joint.body.moments.setZero();
      builder.add(joint);
    }
    const Model<double> model = builder.build();
    for (const unsigned digits : {45u, 1000u}) {
      const auto t = truth_at<double>(model, test::random_state(model, seed), {.digits = digits});
      EXPECT_EQ(t.outcome.status, Outcome::Status::singular);
      EXPECT_EQ(t.responses.size(), 0u);
    }
  }
}

TEST(Truth, VeryLightLastBodyIsNotSingular) {
  const Model<double> model = chain_with_tip(1e-250);
  EXPECT_TRUE(truth_at<double>(model, test::random_state(model, 1)).outcome);
}

TEST(Real, RoundoffFollowsTheDigits) {
  const unsigned before = Real::default_precision();
  {
    const Digits digits(50);
    EXPECT_LT(unit_roundoff<Real>(), Real("1e-50"));
    EXPECT_GT(unit_roundoff<Real>(), Real("1e-52"));
    const Digits more(200);
    EXPECT_LT(unit_roundoff<Real>(), Real("1e-200"));
  }
  EXPECT_EQ(Real::default_precision(), before);
}

}  // namespace
}  // namespace kalmarm
