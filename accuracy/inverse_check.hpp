// Is X the inverse of M? Two answers, neither of which uses the library.
//
// By M = L D L', X = L^-T D^-1 L^-1: entry by entry, nv^3 multiplications.
//
// By the Newton correction dX = X (1 - M X), applied to random v(j) = +-1/sqrt X(j,j):
//   max over i of |X (v - M (X v))|(i) / sqrt X(i,i)
// A probe takes nv^2 multiplications. Its i-th value is the sum over j of
// +-dX(i,j) / sqrt(X(i,i) X(j,j)). One of the two signs of the largest term makes it at least that
// large, so that a probe misses the error of a row with probability 1/2 at most.
#pragma once

#include <optional>

#include "accuracy/real.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

// nothing where a pivot is not positive
std::optional<MatrixX<Real>> ldl_inverse(MatrixX<Real> M);

// The largest of `probes` of them.
double probed_residual(const MatrixX<Real>& M, const MatrixX<Real>& X, int probes);

}  // namespace kalmarm
