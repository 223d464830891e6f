// The true M, M^-1, filter factors and accelerations, for parameters and a state that are exact as
// they stand in T.
//
// Two algorithms that share no kernel work them out in multi-precision:
//
//   filter   D, g, a and X = M^-1 in link frames, by Sequential<ArrayMGS>
//
//   world    M and the torque ID(a) = M a + bias in world axes, by composite inertias and by
//            Newton and Euler (world_mechanics.hpp)
//
// An acceleration is true where the torque that it takes is the one that was given,
//   |X (tau - ID(a))| <= 1e-25 |a|                                                         (1)
// and X where it is the inverse X_w of the world's M by L D L',
//   max |X - X_w|_ij / sqrt(X_ii X_jj) <= 1e-25                                            (2)
// L D L' takes O(nv^3). Above `dense` joints (2) is probed by X (v - M (X v)) for a few random v
// (inverse_check.hpp). Without matrices nothing is worked out that is not O(nv), and the filter
// applies X in (1).
//
// Where the two disagree the digits are doubled; beyond `digits` that is an exception. So is an a
// that is zero by cancellation alone: no digits make (1) small. Digits to start with:
//   40 + 4 log10 nv + 2 log10 rho
// since the condition number of a chain grows as nv^4, and the world frame loses up to two digits
// for every decade of the ratio rho of the largest to the smallest mass.
#pragma once

#include <vector>

#include "accuracy/task.hpp"
#include "algorithms/model/model.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

template <class T>
struct Truth {
  Outcome outcome;     // not ok: no inverse at any precision within the limit; the rest is empty
  MatrixX<Real> M, X;  // nv x nv
  VectorX<Real> D;     // nv
  MatrixX<Real> g;     // 6 x nv
  std::vector<Response<T>> responses;  // one a task
  unsigned digits = 0;                 // carried
  double disagreement = 0;             // of the two algorithms: the largest of the above
};

struct TruthOptions {
  unsigned digits = 1000;
  int dense = 150;
  bool matrices = true;  // false: M, X, D and g stay empty
  int draws = 0;         // for kS of every task; 0: none
};

// q: nq values. T: float or double. Throws std::runtime_error with the numbers if the two
// algorithms do not agree within the digits, or if the torque of a task is beyond the range of T.
template <class T>
Truth<T> truth(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
               const TruthOptions& options = {});

}  // namespace kalmarm
