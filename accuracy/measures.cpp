#include "accuracy/measures.hpp"

#include <Eigen/Eigenvalues>

namespace kalmarm {
namespace {

// max e_i / s_i
double largest_quotient(const VectorX<Real>& e, const VectorX<Real>& s) {
  double worst = 0;
  for (Eigen::Index i = 0; i < e.size(); ++i) worst = larger(worst, quotient(e[i], s[i]));
  return worst;
}

// NaN if an entry is; 0 of nothing
Real largest_entry(const VectorX<Real>& x) {
  Real worst = 0;
  for (const Real& entry : x) worst = larger(worst, Real(abs(entry)));
  return worst;
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
  return {quotient(da.norm(), a.norm()), quotient(sqrt(da.dot(M_da)), sqrt(a.dot(M_a))),
          largest_quotient(da.cwiseAbs(), a.cwiseAbs())};
}

template <class T>
BackwardError backward_error(const VectorX<T>& computed, const VectorX<Real>& a,
                             const MatrixX<Real>& M) {
  const Digits digits(a[0].precision());
  const VectorX<Real> x = computed.template cast<Real>(), torque = M * a;
  const VectorX<Real> r = torque - M * x;
  const MatrixX<Real> M_abs = M.cwiseAbs();
  const Real M_norm = largest_entry(M_abs.rowwise().sum());
  return {quotient(largest_entry(r), M_norm * largest_entry(x) + largest_entry(torque)),
          largest_quotient(r.cwiseAbs(), M_abs * x.cwiseAbs() + torque.cwiseAbs())};
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

template <class T>
double inverse_residual(const MatrixX<T>& computed, const MatrixX<Real>& M) {
  const Digits digits(M(0, 0).precision());
  const MatrixX<Real> R =
      M * computed.template cast<Real>() - MatrixX<Real>::Identity(M.rows(), M.cols());
  return static_cast<double>(largest_entry(R.reshaped()));
}

template <class T>
FactorError factor_error(const VectorX<T>& computed_D, const MatrixX<T>& computed_g,
                         const VectorX<Real>& D, const MatrixX<Real>& g) {
  const Digits digits(D[0].precision());
  const VectorX<Real> dD = computed_D.template cast<Real>() - D;
  const MatrixX<Real> dg = computed_g.template cast<Real>() - g;
  return {largest_quotient(dD.cwiseAbs(), D),
          largest_quotient(dg.colwise().norm(), g.colwise().norm())};
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
template BackwardError backward_error(const VectorX<float>&, const VectorX<Real>&,
                                      const MatrixX<Real>&);
template BackwardError backward_error(const VectorX<double>&, const VectorX<Real>&,
                                      const MatrixX<Real>&);
template MatrixError matrix_error(const MatrixX<float>&, const MatrixX<Real>&);
template MatrixError matrix_error(const MatrixX<double>&, const MatrixX<Real>&);
template MatrixError matrix_error(const MatrixX<Real>&, const MatrixX<Real>&);
template double inverse_residual(const MatrixX<float>&, const MatrixX<Real>&);
template double inverse_residual(const MatrixX<double>&, const MatrixX<Real>&);
template double inverse_residual(const MatrixX<Real>&, const MatrixX<Real>&);
template FactorError factor_error(const VectorX<float>&, const MatrixX<float>&,
                                  const VectorX<Real>&, const MatrixX<Real>&);
template FactorError factor_error(const VectorX<double>&, const MatrixX<double>&,
                                  const VectorX<Real>&, const MatrixX<Real>&);
template FactorError factor_error(const VectorX<Real>&, const MatrixX<Real>&, const VectorX<Real>&,
                                  const MatrixX<Real>&);

}  // namespace kalmarm
