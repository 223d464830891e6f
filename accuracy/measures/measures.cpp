#include "accuracy/measures/measures.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

namespace kalmarm {
namespace {

// The precision of truth while it is computed with.
template <class S>
struct InPrecisionOf {
  explicit InPrecisionOf(const S&) {}
};
template <>
struct InPrecisionOf<Real> {
  explicit InPrecisionOf(const Real& x) : digits(x.precision()) {}
  Digits digits;
};

// max e_i / s_i
template <class S>
double largest_quotient(const VectorX<S>& e, const VectorX<S>& s) {
  double worst = 0;
  for (Eigen::Index i = 0; i < e.size(); ++i) worst = larger(worst, quotient(e[i], s[i]));
  return worst;
}

// NaN if an entry is; 0 of nothing
template <class S>
S largest_entry(const VectorX<S>& x) {
  using std::abs;
  S worst = S(0);
  for (const S& entry : x) worst = larger(worst, S(abs(entry)));
  return worst;
}

// sqrt(x'Mx), NaN where it is rounding of S
template <class S>
S energy_norm(const VectorX<S>& x, const MatrixX<S>& M) {
  using std::sqrt;
  const VectorX<S> M_x = M * x;
  const S square = x.dot(M_x);
  const S rounding = S(x.size()) * unit_roundoff<S>() * x.norm() * M_x.norm();
  if (square < S(100) * rounding && square != S(0)) return std::numeric_limits<S>::quiet_NaN();
  return sqrt(square);
}

double largest_eigenvalue(const MatrixX<double>& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixX<double>>(A, Eigen::EigenvaluesOnly)
      .eigenvalues()
      .maxCoeff();
}

}  // namespace

template <class T, class S>
AccelerationError acceleration_error(const VectorX<T>& computed, const VectorX<S>& a,
                                     const MatrixX<S>& M) {
  const InPrecisionOf<S> precision(a[0]);
  const VectorX<S> da = computed.template cast<S>() - a;
  return {quotient<S>(da.norm(), a.norm()), quotient<S>(energy_norm(da, M), energy_norm(a, M)),
          largest_quotient<S>(da.cwiseAbs(), a.cwiseAbs())};
}

template <class T, class S>
BackwardError backward_error(const VectorX<T>& computed, const VectorX<S>& a, const MatrixX<S>& M) {
  const InPrecisionOf<S> precision(a[0]);
  const VectorX<S> x = computed.template cast<S>(), torque = M * a, r = M * (a - x);
  const MatrixX<S> M_abs = M.cwiseAbs();
  const S M_norm = largest_entry<S>(M_abs.rowwise().sum());
  return {quotient<S>(largest_entry(r), M_norm * largest_entry(x) + largest_entry(torque)),
          largest_quotient<S>(r.cwiseAbs(), M_abs * x.cwiseAbs() + torque.cwiseAbs())};
}

template <class T, class S>
MatrixError matrix_error(const MatrixX<T>& computed, const MatrixX<S>& A) {
  using std::abs, std::sqrt;
  const InPrecisionOf<S> precision(A(0, 0));
  const VectorX<S> scale = A.diagonal().cwiseSqrt();
  S error = S(0), size = S(0), scaled = S(0);  // squares
  for (Eigen::Index j = 0; j < A.cols(); ++j)
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
      const S d = S(computed(i, j)) - A(i, j);
      error += d * d;
      size += A(i, j) * A(i, j);
      scaled = larger(scaled, S(abs(d) / (scale[i] * scale[j])));
    }
  return {quotient<S>(sqrt(error), sqrt(size)), static_cast<double>(scaled)};
}

template <class T, class S>
double inverse_residual(const MatrixX<T>& computed, const MatrixX<S>& M) {
  const InPrecisionOf<S> precision(M(0, 0));
  const MatrixX<S> R = M * computed.template cast<S>() - MatrixX<S>::Identity(M.rows(), M.cols());
  return static_cast<double>(largest_entry<S>(R.reshaped()));
}

template <class T, class S>
FactorError factor_error(const VectorX<T>& computed_D, const MatrixX<T>& computed_g,
                         const VectorX<S>& D, const MatrixX<S>& g) {
  const InPrecisionOf<S> precision(D[0]);
  const VectorX<S> dD = computed_D.template cast<S>() - D;
  const MatrixX<S> dg = computed_g.template cast<S>() - g;
  return {largest_quotient<S>(dD.cwiseAbs(), D),
          largest_quotient<S>(dg.colwise().norm(), g.colwise().norm())};
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

#define KALMARM_INSTANTIATE(T, S)                                                                 \
  template AccelerationError acceleration_error(const VectorX<T>&, const VectorX<S>&,             \
                                                const MatrixX<S>&);                               \
  template BackwardError backward_error(const VectorX<T>&, const VectorX<S>&, const MatrixX<S>&); \
  template MatrixError matrix_error(const MatrixX<T>&, const MatrixX<S>&);                        \
  template double inverse_residual(const MatrixX<T>&, const MatrixX<S>&);                         \
  template FactorError factor_error(const VectorX<T>&, const MatrixX<T>&, const VectorX<S>&,      \
                                    const MatrixX<S>&);
KALMARM_INSTANTIATE(float, Real)
KALMARM_INSTANTIATE(double, Real)
KALMARM_INSTANTIATE(Real, Real)
KALMARM_INSTANTIATE(float, long double)
KALMARM_INSTANTIATE(double, long double)
#undef KALMARM_INSTANTIATE

}  // namespace kalmarm
