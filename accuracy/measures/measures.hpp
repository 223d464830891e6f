// How wrong is a result, and how hard was it? Differences are taken from the computed numbers as
// they stand, in the scalar S that truth is given in: Real, or long double, whose 64 bits are
// enough to judge 53 and a hundred times faster. A NaN in a result makes its errors NaN.
//
// Acceleration:
//   relative   |da| / |a|                       2-norms
//   energy     sqrt(da'M da / a'M a)            free of units; NaN where rounding of S drowns it
//   componentwise   max |da_i| / |a_i|
// and in units of what u in every parameter does to it (structured_condition.hpp)
//   eta        error / (u kS)
// Backward, r = M (a - computed): is it the exact answer to a slightly different M and torque Ma?
//   normwise        |r| / (|M| |computed| + |M a|)                maximum norms
//   componentwise   max |r|_i / (|M| |computed| + |M a|)_i        entries; Oettli and Prager
// A = M or M^-1:
//   relative   |dA| / |A|                       Frobenius norms
//   scaled     max |dA_ij| / sqrt(A_ii A_jj)    free of units
//   residual   max |M X - 1|_ij                 of X = M^-1
// Factors:
//   D          max |dD(k)| / D(k)
//   g          max |dg(k)| / |g(k)|
// Condition of M, and of S M S with S = diag(M)^-1/2, whose diagonal is 1:
//   kappa = lambda_max(M) lambda_max(M^-1)
// Both eigenvalues are largest ones, of accurate matrices rounded to double: kappa is right far
// beyond 1/u, where the smallest eigenvalue of M in double is not.
#pragma once

#include "accuracy/measures/real.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

struct AccelerationError {
  double relative, energy, componentwise;
};
struct BackwardError {
  double normwise, componentwise;
};
struct FactorError {
  double D, g;
};
struct MatrixError {
  double relative, scaled;
};
struct Condition {
  double kappa, kappa_scaled;
};

// error / size, where no error is no error of nothing too.
template <class S>
double quotient(const S& error, const S& size) {
  return error == S(0) ? 0 : static_cast<double>(S(error / size));
}

// |da| / |a| as Outcome::error of refined answers has it: an acceleration below `nothing`,
// u (|gravity| + |qd|^2), is nothing, and its error is told beside that (fast/claims/claims.hpp).
template <class S>
double error_as_told(const S& da, const S& a, const S& nothing) {
  return quotient<S>(da, a < nothing ? nothing : a);
}

// Of a computed acceleration against the true a, with the true M. T: float, double or Real.
template <class T, class S>
AccelerationError acceleration_error(const VectorX<T>& computed, const VectorX<S>& a,
                                     const MatrixX<S>& M);

// The same, looked at from the torque. T: float or double.
template <class T, class S>
BackwardError backward_error(const VectorX<T>& computed, const VectorX<S>& a, const MatrixX<S>& M);

// In units of u kS, with u of T.
template <class T>
double eta(double error, double kS) {
  return error == 0 ? 0 : error / (kS * unit_roundoff<T>());
}

// Of a computed M or M^-1 against the true one.
template <class T, class S>
MatrixError matrix_error(const MatrixX<T>& computed, const MatrixX<S>& A);

// max |M X - 1| of a computed X, with the true M.
template <class T, class S>
double inverse_residual(const MatrixX<T>& computed, const MatrixX<S>& M);

// Of computed D (nv) and g (6 x nv) against the true ones.
template <class T, class S>
FactorError factor_error(const VectorX<T>& computed_D, const MatrixX<T>& computed_g,
                         const VectorX<S>& D, const MatrixX<S>& g);

// Of M, whose inverse is X.
Condition condition(const MatrixX<Real>& M, const MatrixX<Real>& X);

}  // namespace kalmarm
