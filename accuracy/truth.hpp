// The true M, M^-1 and a = M^-1 (tau - bias), for parameters and a state that are exact as they
// stand in T.
//
// Two algorithms that share no kernel work it out in multi-precision:
//
//   filter   a and X = M^-1 in link frames, by Sequential<ArrayMGS>
//
//   world    M and bias in world axes, by composite inertias and Newton-Euler (world_frame.hpp)
//
// With X_w = M^-1 by L D L', they agree where
//   |a - X_w (tau - bias)| <= 1e-25 |a|   and   max |X - X_w|_ij / sqrt(X_ii X_jj) <= 1e-25
// L D L' takes O(nv^3). Above `dense` joints X_w = X, and the second difference is probed by
// X (v - M (X v)) for a few random v (inverse_check.hpp). Where the two disagree the digits are
// doubled; beyond `digits` that is an exception. The condition number of a chain grows as nv^4,
// which sets the digits to start with.
#pragma once

#include "accuracy/real.hpp"
#include "algorithms/model/model.hpp"
#include "algorithms/outcome.hpp"

namespace kalmarm {

struct Truth {
  Outcome outcome;  // not ok: no inverse at any precision within the limit; M, X and a are empty
  MatrixX<Real> M, X;
  VectorX<Real> a;
  unsigned digits = 0;      // carried
  double disagreement = 0;  // of the two algorithms: the larger of the two above
};

struct TruthLimits {
  unsigned digits = 1000;
  int dense = 150;
};

// q: nq, qd and tau: nv values. T: float or double. Throws std::runtime_error with the numbers if
// the two algorithms do not agree within the limits.
template <class T>
Truth truth(const Model<T>& model, const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
            const TruthLimits& limits = {});

}  // namespace kalmarm
