#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "accuracy/measures/measures.hpp"

namespace kalmarm {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

MatrixX<Real> hilbert(int n) {
  MatrixX<Real> H(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) H(i, j) = Real(1) / (i + j + 1);
  return H;
}

class Measures : public testing::Test {
  Digits digits_{100};
};

TEST_F(Measures, AccelerationErrorByHand) {
  const VectorX<Real> a = Eigen::Vector2d(3, 4).cast<Real>();
  const MatrixX<Real> M = Eigen::Vector2d(1, 4).cast<Real>().asDiagonal();
  const VectorX<double> computed = Eigen::Vector2d(3, 4 + 0x1p-10);
  const AccelerationError e = acceleration_error(computed, a, M);
  EXPECT_DOUBLE_EQ(e.relative, 0x1p-10 / 5);
  EXPECT_DOUBLE_EQ(e.energy, 0x1p-9 / std::sqrt(73.0));
  EXPECT_DOUBLE_EQ(e.componentwise, 0x1p-12);
}

TEST_F(Measures, ComponentwiseErrorSeesASmallEntry) {
  const VectorX<Real> a = Eigen::Vector3d(1, 1e-9, 0).cast<Real>();
  const MatrixX<Real> M = MatrixX<Real>::Identity(3, 3);
  VectorX<double> computed = Eigen::Vector3d(1, 1.5e-9, 0);
  EXPECT_NEAR(acceleration_error(computed, a, M).componentwise, 0.5, 1e-12);
  computed[2] = 1e-300;
  EXPECT_TRUE(std::isinf(acceleration_error(computed, a, M).componentwise));
}

// M a = (5, 4); r = M (a - computed) = (0, -e / 2) while |M| |computed| + |M a| = (10, 8 + ...).
TEST_F(Measures, BackwardErrorByHand) {
  MatrixX<Real> M(2, 2);
  M << 1, 1, 1, 0.5;
  const VectorX<Real> a = Eigen::Vector2d(3, 2).cast<Real>();
  const double e = 0x1p-20;
  const VectorX<double> computed = Eigen::Vector2d(3 - e, 2 + e);
  const BackwardError b = backward_error(computed, a, M);
  EXPECT_DOUBLE_EQ(b.normwise, e / 2 / (2 * 3 - 2 * e + 5));
  EXPECT_DOUBLE_EQ(b.componentwise, e / 2 / (8 - e / 2));
}

// Stretched towards the nearly singular direction, a wrong answer leaves next to no residual.
TEST_F(Measures, BackwardErrorsAreBlindToWhatMMakesSmall) {
  MatrixX<Real> M(2, 2);
  M << 1, 1, 1, 1 + Real("1e-12");
  const VectorX<Real> a = VectorX<Real>::Ones(2);
  const VectorX<double> computed = Eigen::Vector2d(2, 0);
  EXPECT_GT(acceleration_error(computed, a, M).relative, 0.9);
  EXPECT_LT(backward_error(computed, a, M).normwise, 1e-12);
  EXPECT_LT(backward_error(computed, a, M).componentwise, 1e-12);
}

TEST_F(Measures, EtaCountsRoundingsOfTheParameters) {
  EXPECT_DOUBLE_EQ(eta<double>(3 * 0x1p-53 * 8, 8), 3);
  EXPECT_DOUBLE_EQ(eta<float>(3 * 0x1p-24 * 8, 8), 3);
  EXPECT_EQ(eta<double>(0, 0), 0);
}

TEST_F(Measures, InverseResidualByHand) {
  MatrixX<Real> M(2, 2);
  M << 2, 1, 1, 1;
  MatrixX<double> X(2, 2);
  X << 1, -1, -1, 2 + 0x1p-10;
  EXPECT_DOUBLE_EQ(inverse_residual(X, M), 0x1p-10);
  X(1, 0) -= 0x1p-9;
  EXPECT_DOUBLE_EQ(inverse_residual(X, M), 0x1p-9);
}

TEST_F(Measures, FactorErrorByHand) {
  const VectorX<Real> D = Eigen::Vector2d(1e-6, 5).cast<Real>();
  MatrixX<Real> g = MatrixX<Real>::Zero(6, 2);
  g(2, 0) = 3;
  g(5, 0) = 4;
  g(2, 1) = 1;
  const VectorX<float> computed_D = Eigen::Vector2f(1e-6f, 5 + 0x1p-10f);
  MatrixX<float> computed_g = g.cast<float>();
  computed_g(0, 0) = 0x1p-10f;
  const FactorError e = factor_error(computed_D, computed_g, D, g);
  EXPECT_DOUBLE_EQ(e.D, 0x1p-10 / 5);
  EXPECT_DOUBLE_EQ(e.g, 0x1p-10 / 5);
}

TEST_F(Measures, MatrixErrorByHand) {
  MatrixX<Real> A(2, 2);
  A << 4, 1, 1, 9;
  MatrixX<float> computed(2, 2);
  computed << 4.0f, 1.25f, 1.25f, 9.0f;
  const MatrixError e = matrix_error(computed, A);
  EXPECT_DOUBLE_EQ(e.relative, 0.25 * std::sqrt(2.0 / 99));
  EXPECT_DOUBLE_EQ(e.scaled, 0.25 / 6);
}

TEST_F(Measures, ErrorBelowTheRoundingOfTheResultIsSeen) {
  VectorX<Real> a(1);
  a[0] = 1 + Real("1e-30");
  const MatrixX<Real> A = a;
  EXPECT_DOUBLE_EQ(acceleration_error(VectorX<double>(VectorX<double>::Ones(1)), a, A).relative,
                   1e-30);
  EXPECT_DOUBLE_EQ(matrix_error(MatrixX<double>(MatrixX<double>::Ones(1, 1)), A).relative, 1e-30);
  EXPECT_DOUBLE_EQ(matrix_error(MatrixX<double>(MatrixX<double>::Ones(1, 1)), A).scaled, 1e-30);
}

// Neither the results nor a'M a = 2e-30 fit into the twelve digits in force.
TEST_F(Measures, DigitsAreThoseOfTheTruth) {
  MatrixX<Real> M(2, 2);
  M << 1, Real("1e-30") - 1, Real("1e-30") - 1, 1;
  const VectorX<Real> a = VectorX<Real>::Ones(2);
  const VectorX<double> computed = (1 + 0x1p-50) * VectorX<double>::Ones(2);
  const Digits digits(12);
  EXPECT_DOUBLE_EQ(acceleration_error(computed, a, M).energy, 0x1p-50);
  const MatrixX<Real> A = a.head(1);
  EXPECT_DOUBLE_EQ(matrix_error(MatrixX<double>(computed.head(1)), A).relative, 0x1p-50);
}

TEST_F(Measures, NoErrorIsZero) {
  const MatrixX<double> A = hilbert(4).cast<double>();
  const MatrixX<Real> exact = A.cast<Real>();
  const VectorX<double> a = A.col(2), zero = VectorX<double>::Zero(4);
  EXPECT_EQ(matrix_error(A, exact).relative, 0);
  EXPECT_EQ(matrix_error(A, exact).scaled, 0);
  EXPECT_EQ(acceleration_error(a, VectorX<Real>(a.cast<Real>()), exact).relative, 0);
  EXPECT_EQ(acceleration_error(a, VectorX<Real>(a.cast<Real>()), exact).energy, 0);
  EXPECT_EQ(acceleration_error(zero, VectorX<Real>(zero.cast<Real>()), exact).relative, 0);
  EXPECT_EQ(acceleration_error(zero, VectorX<Real>(zero.cast<Real>()), exact).energy, 0);
  EXPECT_EQ(acceleration_error(zero, VectorX<Real>(zero.cast<Real>()), exact).componentwise, 0);
  EXPECT_EQ(backward_error(zero, VectorX<Real>(zero.cast<Real>()), exact).normwise, 0);
  EXPECT_EQ(backward_error(zero, VectorX<Real>(zero.cast<Real>()), exact).componentwise, 0);
}

TEST_F(Measures, NanAnywhereIsNanEverywhere) {
  const MatrixX<Real> A = hilbert(3);
  for (int i = 0; i < 3; ++i) {
    VectorX<double> a = VectorX<double>::Ones(3);
    a[i] = nan;
    const AccelerationError ea = acceleration_error(a, VectorX<Real>(A.col(0)), A);
    EXPECT_TRUE(std::isnan(ea.relative) && std::isnan(ea.energy));
    EXPECT_TRUE(std::isnan(ea.componentwise));
    const BackwardError b = backward_error(a, VectorX<Real>(A.col(0)), A);
    EXPECT_TRUE(std::isnan(b.normwise) && std::isnan(b.componentwise));
    for (int j = 0; j < 3; ++j) {
      MatrixX<double> X = MatrixX<double>::Zero(3, 3);
      X(i, j) = nan;
      const MatrixError ex = matrix_error(X, A);
      EXPECT_TRUE(std::isnan(ex.relative) && std::isnan(ex.scaled)) << i << ' ' << j;
      EXPECT_TRUE(std::isnan(inverse_residual(X, A)));
    }
  }
}

MatrixX<Real> inverse_of(const MatrixX<Real>& M) {
  return M.llt().solve(MatrixX<Real>::Identity(M.rows(), M.cols()));
}

// kappa of Hilbert's matrix: 476607.25 at n = 5; 2.45e28 at n = 20, beyond 1/u of double.
TEST_F(Measures, ConditionOfHilbertMatrices) {
  const MatrixX<Real> H5 = hilbert(5), H20 = hilbert(20);
  EXPECT_NEAR(condition(H5, inverse_of(H5)).kappa, 476607.25, 0.005);
  EXPECT_NEAR(condition(H20, inverse_of(H20)).kappa / 2.4521565858153031725e28, 1, 1e-10);
}

TEST_F(Measures, DiagonalScalingLeavesTheScaledConditionAlone) {
  const MatrixX<Real> H = hilbert(5);
  VectorX<Real> s(5);
  s << 1, 1e6, 1e-9, 1e3, 1e-2;
  const MatrixX<Real> scaled = s.asDiagonal() * H * s.asDiagonal();
  const Condition before = condition(H, inverse_of(H)),
                  after = condition(scaled, inverse_of(scaled));
  EXPECT_GT(after.kappa, 1e20 * before.kappa);
  EXPECT_NEAR(after.kappa_scaled / before.kappa_scaled, 1, 1e-12);

  const MatrixX<Real> diagonal = s.asDiagonal();
  const Condition c = condition(diagonal, inverse_of(diagonal));
  EXPECT_NEAR(c.kappa / 1e15, 1, 1e-12);
  EXPECT_NEAR(c.kappa_scaled, 1, 1e-12);
}

}  // namespace
}  // namespace kalmarm
