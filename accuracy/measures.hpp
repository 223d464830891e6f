// How wrong is a result, and how hard was it? Differences are taken in multi-precision from the
// computed numbers as they stand; a NaN in a result makes its errors NaN.
//
// Acceleration:
//   relative   |da| / |a|                       2-norms
//   energy     sqrt(da'M da / a'M a)            free of units
// A = M or M^-1:
//   relative   |dA| / |A|                       Frobenius norms
//   scaled     max |dA_ij| / sqrt(A_ii A_jj)    free of units
// Condition of M, and of S M S with S = diag(M)^-1/2, whose diagonal is 1:
//   kappa = lambda_max(M) lambda_max(M^-1)
// Both eigenvalues are largest ones, of accurate matrices rounded to double: kappa is right far
// beyond 1/u, where the smallest eigenvalue of M in double is not.
#pragma once

#include "accuracy/real.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

struct AccelerationError {
  double relative, energy;
};
struct MatrixError {
  double relative, scaled;
};
struct Condition {
  double kappa, kappa_scaled;
};

// Of a computed acceleration against the true a, with the true M. T: float, double or Real.
template <class T>
AccelerationError acceleration_error(const VectorX<T>& computed, const VectorX<Real>& a,
                                     const MatrixX<Real>& M);

// Of a computed M or M^-1 against the true one.
template <class T>
MatrixError matrix_error(const MatrixX<T>& computed, const MatrixX<Real>& A);

// Of M, whose inverse is X.
Condition condition(const MatrixX<Real>& M, const MatrixX<Real>& X);

}  // namespace kalmarm
