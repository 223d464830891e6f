// An upper bound of the condition number of M scaled to unit diagonal, which is what a Cholesky
// factorisation loses: with S = diag(M)^-1/2 and Frobenius norms, |S M S| |S^-1 M^-1 S^-1|.
#pragma once

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

// From M and X = M^-1 (nv x nv). At most nv times the condition number in the 2-norm. O(nv^2).
inline double scaled_condition_bound(const MatrixX<double>& M, const MatrixX<double>& X) {
  const VectorX<double> root = M.diagonal().cwiseSqrt();
  const VectorX<double> S = root.cwiseInverse();
  return (S.asDiagonal() * M * S.asDiagonal()).norm() *
         (root.asDiagonal() * X * root.asDiagonal()).norm();
}

}  // namespace kalmarm
