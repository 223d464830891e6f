// The operational inertia against inverses in long double, and where there is none.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "kalmarm/kinematics.hpp"
#include "kalmarm/operational_space.hpp"

namespace kalmarm::test {
namespace {

using Long = MatrixX<long double>;

// Largest |is - should|(i,j) / sqrt(should(i,i) should(j,j)).
template <class T>
double scaled_error(const MatrixX<T>& is, const Long& should) {
  const VectorX<long double> scale = should.diagonal().cwiseSqrt().cwiseInverse();
  const Long d =
      scale.asDiagonal() * (is.template cast<long double>() - should) * scale.asDiagonal();
  return static_cast<double>(d.cwiseAbs().maxCoeff());
}

// The largest eigenvalue of Y^-1, by Y of the header's (1).
template <class T>
long double scaled_inverse_norm(const MatrixX<T>& X, int alike) {
  Long Y = X.template cast<long double>();
  VectorX<long double> S(Y.rows());
  for (int i = 0; i < S.size(); i += alike)
    S.segment(i, alike).setConstant(1 / std::sqrt(Y.diagonal().segment(i, alike).mean()));
  const Long scaled = S.asDiagonal() * Y * S.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Long>(Long(scaled.inverse())).eigenvalues().maxCoeff();
}

// A symmetric matrix with about these eigenvalues, but for units that differ by far, of each so many rows alike.
MatrixX<double> of_eigenvalues(const VectorX<double>& w, std::uint64_t seed, int alike) {
  Random random(seed);
  const int k = static_cast<int>(w.size());
  MatrixX<double> A(k, k);
  for (int j = 0; j < k; ++j) A.col(j) = random.vector(k);
  const MatrixX<double> Q = A.householderQr().householderQ();
  VectorX<double> units(k);
  for (int i = 0; i < k; i += alike)
    units.segment(i, alike).setConstant(std::pow(10.0, random.uniform(-3, 3)));
  const MatrixX<double> X =
      units.asDiagonal() * Q * w.asDiagonal() * Q.transpose() * units.asDiagonal();
  return 0.5 * (X + X.transpose());
}

template <class T>
class Operational : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Operational, Precisions, PrecisionName);

TYPED_TEST(Operational, InertiaIsTheInverseWithinItsError) {
  using T = TypeParam;
  for (int seed = 0; seed < 40; ++seed) {
    const int alike = seed % 2 == 0 ? 3 : 1, k = alike * (1 + seed % (12 / alike));
    VectorX<double> w(k);
    for (int i = 0; i < k; ++i) w[i] = std::pow(10.0, -(seed % 4) * i / double(k));
    const MatrixX<T> X = of_eigenvalues(w, seed, alike).cast<T>();
    MatrixX<T> Lambda = poisoned<T>(k, k);
    const Outcome outcome = OperationalInertia<T>(k, {}, alike).compute(X, Lambda);
    ASSERT_TRUE(outcome) << seed;
    const Long exact = X.template cast<long double>().inverse();
    EXPECT_LE(scaled_error(Lambda, exact), outcome.error) << seed;
    EXPECT_TRUE(Lambda == Lambda.transpose());
    EXPECT_NEAR(outcome.D, 1.0 / static_cast<double>(scaled_inverse_norm(X, alike)),
                1e-2 * outcome.D + 10 * k * unit_roundoff<T>())
        << seed;
  }
}

// Of a robot: forces Lambda x'' at its frame accelerate it by x'', and torques N' tau do not.
TYPED_TEST(Operational, InertiaTurnsAccelerationsIntoForces) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  const Model<double> model = rounded<T>(creature(5));
  const int nv = model.nv(), k = 6;
  const std::vector<Frame> frames = {{nv / 2, {1, 0, 0.1, 0}, {0, 0.1, 0}}};
  Dynamics<T> robot = dynamics_of<T>(model, {.question = {.frames = frames}});
  const State<T> s = random_state(model, 6).template cast<T>();
  MatrixX<T> X(k, k), Lambda(k, k), Jt(nv, k), MJ(nv, k);
  ASSERT_TRUE(robot.operational(s.q, X));
  Kinematics<T>(plain(model), frames).compute(s.q, {.axes = Axes::local, .jacobians = Jt});
  const Outcome outcome = OperationalInertia<T>(k).compute(X, Lambda);
  ASSERT_TRUE(outcome);
  const double bound = 100 * u * outcome.scale / outcome.D;
  ASSERT_TRUE(robot.factor(s.q));
  ASSERT_TRUE(robot.solve(Jt, MJ));
  const MatrixX<T> one = Jt.transpose() * MJ * Lambda;
  const VectorX<T> S = X.diagonal().cwiseSqrt();
  const MatrixX<T> scaled = S.cwiseInverse().asDiagonal() * one * S.asDiagonal();
  EXPECT_LE(static_cast<double>((scaled - MatrixX<T>::Identity(k, k)).cwiseAbs().maxCoeff()),
            bound);
  const VectorX<T> moves = MJ.transpose() * s.tau, still = moves - one * moves;
  EXPECT_LE(static_cast<double>(still.cwiseQuotient(S).norm()),
            bound * static_cast<double>(moves.cwiseQuotient(S).norm()) * k);
}

// Rows in other units change nothing but the units: to the bit, by powers of two.
TYPED_TEST(Operational, InertiaDoesNotDependOnUnits) {
  using T = TypeParam;
  VectorX<double> w(6);
  w << 1, 0.5, 0.1, 0.05, 0.01, 0.002;
  const MatrixX<T> X = of_eigenvalues(w, 3, 3).cast<T>();
  VectorX<T> units(6);
  units << T(4), T(4), T(4), T(0.125), T(0.125), T(0.125);
  const MatrixX<T> other = units.asDiagonal() * X * units.asDiagonal();
  for (const Regularisation& how :
       {Regularisation{}, Regularisation{.damping = 0.01}, Regularisation{.clamp = 10}}) {
    OperationalInertia<T> inertia(6, how);
    MatrixX<T> one(6, 6), two(6, 6);
    const Outcome a = inertia.compute(X, one), b = inertia.compute(other, two);
    ASSERT_TRUE(a);
    ASSERT_TRUE(b);
    EXPECT_TRUE((units.asDiagonal() * two * units.asDiagonal()).eval() == one);
    EXPECT_EQ(a.error, b.error);
    EXPECT_EQ(a.D, b.D);
  }
}

// A clamp bounds the condition number, and above the robot's own it does nothing; damping is that of (X + d diag X)^-1.
TEST(Regularised, InertiaIsThatOfItsDefinition) {
  VectorX<double> w(5);
  w << 1, 0.3, 0.1, 0.01, 1e-9;
  const MatrixX<double> X = of_eigenvalues(w, 4, 1);
  MatrixX<double> plain_one(5, 5), Lambda(5, 5);
  const Outcome outcome = OperationalInertia<double>(5, {}, 1).compute(X, plain_one);
  ASSERT_TRUE(outcome);
  const double condition = outcome.scale / outcome.D;
  ASSERT_TRUE(OperationalInertia<double>(5, {.clamp = 2 * condition}, 1).compute(X, Lambda));
  EXPECT_TRUE(Lambda == plain_one);

  const Long Xl = X.cast<long double>();
  const Long damped = Xl + 0.01L * Long(Xl.diagonal().asDiagonal());
  ASSERT_TRUE(OperationalInertia<double>(5, {.damping = 0.01}, 1).compute(X, Lambda));
  EXPECT_LE(scaled_error(Lambda, Long(damped.inverse())), 1e-12);

  ASSERT_TRUE(OperationalInertia<double>(5, {.clamp = 100}, 1).compute(X, Lambda));
  const VectorX<double> S = X.diagonal().cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<MatrixX<double>> of(S.asDiagonal() * Lambda * S.asDiagonal());
  EXPECT_NEAR(of.eigenvalues()[4] / of.eigenvalues()[0], 100, 1e-8);
}

// An arm of two hinges that is stretched out cannot move its tip along itself: no inertia there, and with a
// clamp one that is finite.
TYPED_TEST(Operational, InertiaOfAStretchedArmIsRefusedOrClamped) {
  using T = TypeParam;
  MatrixX<T> X(2, 2), Lambda(2, 2);
  X << T(1), T(1e-3), T(1e-3), T(1e-6);  // of rank one, in two units
  Outcome outcome = OperationalInertia<T>(2, {}, 1).compute(X, Lambda);
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_EQ(outcome.joint, -1);
  EXPECT_TRUE(Lambda.array().isNaN().all());
  outcome = OperationalInertia<T>(2, {.clamp = 50}, 1).compute(X, Lambda);
  EXPECT_TRUE(outcome);
  EXPECT_FALSE(outcome.warns());
  EXPECT_LE(outcome.D, 1e-6 * outcome.scale);
  EXPECT_TRUE(Lambda.allFinite());
}

TYPED_TEST(Operational, InertiaOfRowsThatNoJointMovesIsRefusedByTheirNumber) {
  using T = TypeParam;
  MatrixX<T> X = MatrixX<T>::Identity(6, 6), Lambda(6, 6);
  X.template bottomRightCorner<3, 3>().setZero();
  for (const Regularisation& how : {Regularisation{}, Regularisation{.damping = 0.1, .clamp = 10}})
    for (const int alike : {1, 3}) {
      const Outcome outcome = OperationalInertia<T>(6, how, alike).compute(X, Lambda);
      EXPECT_EQ(outcome.status, Outcome::Status::singular);
      EXPECT_EQ(outcome.joint, 3);
    }
}

// A frame that moves in some of its directions alone has an inertia with a clamp, whatever its axes are.
TYPED_TEST(Operational, ClampedInertiaTurnsWithTheFrame) {
  using T = TypeParam;
  MatrixX<T> X = MatrixX<T>::Zero(3, 3), one(3, 3), other(3, 3);
  X(0, 0) = T(2), X(2, 2) = T(1);
  const Matrix3<T> R =
      Eigen::AngleAxis<T>(T(0.7), Vector3<T>(1, 2, 3).normalized()).toRotationMatrix();
  OperationalInertia<T> inertia(3, {.clamp = 20});
  ASSERT_TRUE(inertia.compute(X, one));
  ASSERT_TRUE(inertia.compute(MatrixX<T>(R * X * R.transpose()), other));
  EXPECT_LE((R * one * R.transpose() - other).norm(), 100 * unit_roundoff<T>() * one.norm());
  EXPECT_NEAR(static_cast<double>(one(1, 1)), 10, 1e-4);
}

TYPED_TEST(Operational, InertiaOfARowDisturbsNoOther) {
  using T = TypeParam;
  const int k = 4, alike = 2, count = 5;
  VectorX<double> w(k);
  w << 1, 0.5, 0.2, 0.1;
  std::vector<T> X, Lambda(count * k * k);
  std::vector<Outcome> of_X(count), outcomes(count);
  for (int i = 0; i < count; ++i) {
    MatrixX<T> one = of_eigenvalues(w, i, alike).cast<T>();
    if (i == 1) one.setOnes();
    if (i == 2) one(3, 0) = one(0, 3) = std::numeric_limits<T>::quiet_NaN();
    X.insert(X.end(), one.data(), one.data() + one.size());
  }
  of_X[3].status = Outcome::Status::indefinite;
  of_X[4].error = 0.02;
  OperationalInertia<T> inertia(k, {}, alike);
  EXPECT_EQ(inertia.compute(X, Lambda, outcomes, of_X), 3);
  const Outcome::Status expected[] = {Outcome::Status::ok, Outcome::Status::singular,
                                      Outcome::Status::not_finite, Outcome::Status::indefinite,
                                      Outcome::Status::ok};
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(outcomes[i].status, expected[i]) << i;
    const Eigen::Map<const MatrixX<T>> row(&Lambda[i * k * k], k, k), of(&X[i * k * k], k, k);
    if (!outcomes[i]) {
      EXPECT_TRUE(row.array().isNaN().all()) << i;
      continue;
    }
    MatrixX<T> alone(k, k);
    ASSERT_TRUE(inertia.compute(MatrixX<T>(of), alone));
    EXPECT_TRUE(alone == row) << i;
  }
  EXPECT_FALSE(outcomes[0].warns());
  EXPECT_TRUE(outcomes[4].warns());
}

// The link with most joints between it and the base, by which rows of J are independent.
int deepest(const Model<double>& model) {
  std::vector<int> depth;
  for (int k = 0; k < model.nv(); ++k)
    depth.push_back(model.parent(k) < 0 ? 0 : depth[model.parent(k)] + 1);
  return static_cast<int>(std::max_element(depth.begin(), depth.end()) - depth.begin());
}

// What a task of some rows of J needs, of many states.
template <class T>
struct Task {
  Model<double> model;
  int nv, k, count;
  std::vector<T> W, Jt;  // M^-1 and J' of rows
  std::vector<Outcome> of_W;

  Task(std::uint64_t seed, int rows_of_J, int states)
      : model(rounded<T>(creature(seed))), nv(model.nv()), k(rows_of_J), count(states) {
    W.resize(count * nv * nv);
    of_W.resize(count);
    const std::vector<Frame> frames = {{deepest(model), {1, 0, 0.1, 0}, {0, 0.1, 0}}};
    Dynamics<T> robot = dynamics_of<T>(model, {.question = {.want = {Want::inverse}}});
    Kinematics<T> kinematics(plain(model), frames);
    std::vector<T> q;
    for (int i = 0; i < count; ++i) {
      const VectorX<T> one = random_state(model, seed + i).q.template cast<T>();
      q.insert(q.end(), one.begin(), one.end());
      MatrixX<T> columns(nv, 6);
      kinematics.compute(one, {.axes = Axes::aligned, .jacobians = columns});
      Jt.insert(Jt.end(), columns.data() + (6 - k) * nv, columns.data() + 6 * nv);
    }
    EXPECT_EQ(robot.inverse_mass(q, W, of_W), 0);
  }

  Long inverse_mass(int i) const {
    return Eigen::Map<const MatrixX<T>>(&W[i * nv * nv], nv, nv).template cast<long double>();
  }
  Long J(int i) const {
    return Eigen::Map<const MatrixX<T>>(&Jt[i * nv * k], nv, k)
        .template cast<long double>()
        .transpose();
  }
};

// Against their definitions in long double, in the units that M^-1 and J M^-1 J' give; and one row as many.
TYPED_TEST(Operational, InverseAndProjectorAreThoseOfTheirDefinitions) {
  using T = TypeParam;
  constexpr int count = 6;
  for (const int k : {1, 3, 6}) {
    const Task<T> task(11, k, count);
    const int nv = task.nv;
    std::vector<T> Lambda(count * k * k), inverse(count * nv * k), projector(count * nv * nv);
    std::vector<Outcome> outcomes(count);
    OperationalInertia<T> inertia(k, {}, std::min(k, 3));
    EXPECT_EQ(inertia.compute(task.W, task.Jt,
                              {.inertia = RowsView<T>(Lambda),
                               .inverse = RowsView<T>(inverse),
                               .projector = RowsView<T>(projector)},
                              outcomes, task.of_W),
              0);
    for (int i = 0; i < count; ++i) {
      const Long W = task.inverse_mass(i), J = task.J(i), X = J * W * J.transpose(),
                 exact = X.inverse(), exact_inverse = W * J.transpose() * exact,
                 exact_projector = Long::Identity(nv, nv) - exact_inverse * J;
      const MatrixX<T> L = Eigen::Map<MatrixX<T>>(&Lambda[i * k * k], k, k),
                       G = Eigen::Map<MatrixX<T>>(&inverse[i * nv * k], nv, k),
                       N = Eigen::Map<MatrixX<T>>(&projector[i * nv * nv], nv, nv);
      const double error = outcomes[i].error;
      EXPECT_LE(scaled_error(L, exact), error) << i;
      // (4) by (7), of an M^-1 that is wrong by rounding.
      const VectorX<long double> sums = J.cwiseAbs() * W.diagonal().cwiseSqrt();
      const auto eta =
          static_cast<double>(sums.array().square().cwiseQuotient(X.diagonal().array()).maxCoeff());
      const double w = 1 / static_cast<double>(scaled_inverse_norm(X, std::min(k, 3)));
      EXPECT_NEAR(error, k * eta * 4 * static_cast<double>(unit_roundoff<T>()) / w, 0.01 * error);
      const VectorX<long double> d = W.diagonal().cwiseSqrt(), s = X.diagonal().cwiseSqrt();
      const Long of_G = d.cwiseInverse().asDiagonal() *
                        (G.template cast<long double>() - exact_inverse) * s.asDiagonal();
      const Long of_N = d.cwiseInverse().asDiagonal() *
                        (N.template cast<long double>() - exact_projector) * d.asDiagonal();
      EXPECT_LE(of_G.cwiseAbs().maxCoeff(), k * error) << i;
      EXPECT_LE(of_N.cwiseAbs().maxCoeff(), k * error) << i;

      MatrixX<T> alone = poisoned<T>(nv, k), N_alone = poisoned<T>(nv, nv);
      const MatrixX<T> W_alone = W.template cast<T>(), Jt = J.transpose().template cast<T>();
      const Outcome one = inertia.compute(W_alone, Jt, {.inverse = alone, .projector = N_alone},
                                          task.of_W[i].error);
      EXPECT_EQ(one.error, error);
      EXPECT_TRUE(alone == G && N_alone == N) << i;
    }
  }
}

TYPED_TEST(Operational, FailedRowOfATaskDisturbsNoOther) {
  using T = TypeParam;
  constexpr int count = 4, k = 3;
  Task<T> task(12, k, count);
  const int nv = task.nv;
  std::fill_n(&task.Jt[1 * nv * k], nv * k, T(0));  // no joint moves it
  task.Jt[2 * nv * k] = std::numeric_limits<T>::quiet_NaN();
  task.of_W[3] = {.status = Outcome::Status::singular, .joint = 1};
  std::vector<T> inverse(count * nv * k);
  std::vector<Outcome> outcomes(count);
  EXPECT_EQ(OperationalInertia<T>(k).compute(task.W, task.Jt, {.inverse = RowsView<T>(inverse)},
                                             outcomes, task.of_W),
            3);
  const Outcome::Status expected[] = {Outcome::Status::ok, Outcome::Status::singular,
                                      Outcome::Status::not_finite, Outcome::Status::singular};
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(outcomes[i].status, expected[i]) << i;
    const Eigen::Map<MatrixX<T>> G(&inverse[i * nv * k], nv, k);
    EXPECT_EQ(G.allFinite(), i == 0);
    EXPECT_EQ(G.array().isNaN().all(), i != 0);
  }
  EXPECT_EQ(outcomes[1].joint, 0);
}

TEST(Regularised, TaskOfOtherSizesIsRefused) {
  OperationalInertia<double> inertia(3);
  const MatrixX<double> W = MatrixX<double>::Identity(4, 4), Jt = MatrixX<double>::Ones(4, 3),
                        five = MatrixX<double>::Ones(5, 3), wide = MatrixX<double>::Ones(4, 2);
  MatrixX<double> N(3, 3);
  EXPECT_THROW((void)inertia.compute(W, five, {}), std::invalid_argument);
  EXPECT_THROW((void)inertia.compute(W, wide, {}), std::invalid_argument);
  EXPECT_THROW((void)inertia.compute(W, Jt, {.projector = N}), std::invalid_argument);
  EXPECT_THROW((void)inertia.compute({}, Jt, {}), std::invalid_argument);
  Eigen::Matrix<double, -1, -1, Eigen::RowMajor> by_rows = Jt, N_by_rows(4, 4);
  EXPECT_THROW((void)inertia.compute(W, by_rows, {}), std::invalid_argument);
  EXPECT_THROW((void)inertia.compute(W, Jt, {.inverse = by_rows}), std::invalid_argument);
  EXPECT_THROW((void)inertia.compute(W, Jt, {.projector = N_by_rows}), std::invalid_argument);
}

TEST(Regularised, WhatIsNoRegularisationIsRefused) {
  EXPECT_THROW(OperationalInertia<double>(0), std::invalid_argument);
  EXPECT_THROW(OperationalInertia<double>(4), std::invalid_argument);
  EXPECT_THROW(OperationalInertia<double>(3, {.damping = -1}), std::invalid_argument);
  EXPECT_THROW(OperationalInertia<double>(3, {.clamp = 0.5}), std::invalid_argument);
  EXPECT_THROW(OperationalInertia<double>(3, {.clamp = std::nan("")}), std::invalid_argument);
  MatrixX<double> X = MatrixX<double>::Identity(3, 3), Lambda(2, 2);
  EXPECT_THROW((void)OperationalInertia<double>(3).compute(X, Lambda), std::invalid_argument);
}

}  // namespace
}  // namespace kalmarm::test
