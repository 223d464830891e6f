#include "accuracy/inverse_check.hpp"

#include <random>

namespace kalmarm {

std::optional<MatrixX<Real>> ldl_inverse(MatrixX<Real> M) {
  const int n = static_cast<int>(M.rows());

  // M <- L below the diagonal, D on it
  for (int k = 0; k < n; ++k) {
    if (!(M(k, k) > 0)) return {};
    for (int j = k + 1; j < n; ++j) {
      const Real l = M(j, k) / M(k, k);
      for (int i = j; i < n; ++i) M(i, j) -= l * M(i, k);
    }
    for (int j = k + 1; j < n; ++j) M(j, k) /= M(k, k);
  }

  // L <- L^-1, column by column
  for (int j = 0; j < n; ++j)
    for (int k = j + 1; k < n; ++k) {
      Real sum = M(k, j);
      for (int i = j + 1; i < k; ++i) sum += M(k, i) * M(i, j);
      M(k, j) = -sum;
    }

  // X = L^-T D^-1 L^-1
  MatrixX<Real> X(n, n);
  for (int i = 0; i < n; ++i) {
    const Real D = M(i, i);
    M(i, i) = 1;
    for (int j = 0; j <= i; ++j) X(i, j) = M(i, j) / D;
    for (int k = i + 1; k < n; ++k) {
      const Real l = M(k, i) / M(k, k);
      for (int j = 0; j <= i; ++j) X(i, j) += l * M(k, j);
    }
  }
  X.triangularView<Eigen::StrictlyUpper>() = X.transpose();
  return X;
}

double probed_residual(const MatrixX<Real>& M, const MatrixX<Real>& X, int probes) {
  const Eigen::Index n = M.rows();
  const VectorX<Real> scale = X.diagonal().cwiseSqrt();
  std::mt19937 random(1);
  Real worst = 0;
  for (int probe = 0; probe < probes; ++probe) {
    VectorX<Real> v(n);
    for (Eigen::Index j = 0; j < n; ++j) v[j] = (random() % 2 ? 1 : -1) / scale[j];
    const VectorX<Real> y = X * v;
    const VectorX<Real> r = v - M * y;
    const VectorX<Real> dx = X * r;
    for (Eigen::Index i = 0; i < n; ++i) worst = larger(worst, Real(abs(dx[i]) / scale[i]));
  }
  return static_cast<double>(worst);
}

}  // namespace kalmarm
