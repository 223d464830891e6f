#include "accuracy/measures.hpp"

#include <Eigen/Eigenvalues>

namespace kalmarm {
namespace {

// error / size, where no error is no error of nothing too
double quotient(const Real& error, const Real& size) {
  return error == 0 ? 0 : static_cast<double>(Real(error / size));
}

double largest_eigenvalue(const MatrixX<double>& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixX<double>>(A, Eigen::EigenvaluesOnly)
      .eigenvalues()
      .maxCoeff();
}

}  // namespace

template <class T>
AccelerationError acceleration_error(const VectorX<T>& computed, const VectorX<Real>& a,
                                     const MatrixX<Real>& M) {
  const Digits digits(a[0].precision());
  const VectorX<Real> da = computed.template cast<Real>() - a;
  const VectorX<Real> M_da = M * da, M_a = M * a;
  return {quotient(da.norm(), a.norm()), quotient(sqrt(da.dot(M_da)), sqrt(a.dot(M_a)))};
}

template <class T>
MatrixError matrix_error(const MatrixX<T>& computed, const MatrixX<Real>& A) {
  const Digits digits(A(0, 0).precision());
  const VectorX<Real> scale = A.diagonal().cwiseSqrt();
  Real error = 0, size = 0, scaled = 0;  // squares
  for (Eigen::Index j = 0; j < A.cols(); ++j)
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
      const Real d = Real(computed(i, j)) - A(i, j);
      error += d * d;
      size += A(i, j) * A(i, j);
      scaled = larger(scaled, abs(d) / (scale[i] * scale[j]));
    }
  return {quotient(sqrt(error), sqrt(size)), static_cast<double>(scaled)};
}

Condition condition(const MatrixX<Real>& M, const MatrixX<Real>& X) {
  const MatrixX<double> M_double = M.cast<double>(), X_double = X.cast<double>();
  const VectorX<double> s = M_double.diagonal().cwiseSqrt();
  const MatrixX<double> M_scaled =
      s.cwiseInverse().asDiagonal() * M_double * s.cwiseInverse().asDiagonal();
  const MatrixX<double> X_scaled = s.asDiagonal() * X_double * s.asDiagonal();
  return {largest_eigenvalue(M_double) * largest_eigenvalue(X_double),
          largest_eigenvalue(M_scaled) * largest_eigenvalue(X_scaled)};
}

template AccelerationError acceleration_error(const VectorX<float>&, const VectorX<Real>&,
                                              const MatrixX<Real>&);
template AccelerationError acceleration_error(const VectorX<double>&, const VectorX<Real>&,
                                              const MatrixX<Real>&);
template AccelerationError acceleration_error(const VectorX<Real>&, const VectorX<Real>&,
                                              const MatrixX<Real>&);
template MatrixError matrix_error(const MatrixX<float>&, const MatrixX<Real>&);
template MatrixError matrix_error(const MatrixX<double>&, const MatrixX<Real>&);
template MatrixError matrix_error(const MatrixX<Real>&, const MatrixX<Real>&);

}  // namespace kalmarm
