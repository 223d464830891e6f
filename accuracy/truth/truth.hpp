// The true M, M^-1, filter factors and accelerations, for parameters and a state that are exact as
// they stand in T.
//
// The filter works them out in multi-precision, in link frames: D, g, a and X = M^-1 by
// Sequential<ArrayMGS>. M is the centre of its enclosure. What came out is then proven
// (enclosure.hpp): by ball arithmetic on other formulas, those of the world frame, and by bounds of
// the filter that hold for every rounding, each number is known to be no further from the true one
// than a width, by the measures of measures.hpp. A truth is handed out if
//   every width <= 1e-25                                                                   (1)
// of M, X, D, g and, in both norms, of every acceleration. An acceleration's componentwise width is
// recorded, but may be infinite: where symmetry makes an entry zero, no digits prove its sign.
//
// Where (1) does not hold the digits are doubled; beyond `digits` that is an exception. So is an a
// that is zero by cancellation alone: no digits make its relative width small. Digits to start
// with:
//   40 + 4 log10 nv + 2 log10 rho
// since the condition number of a chain grows as nv^4, and the world frame loses up to two digits
// for every decade of the ratio rho of the largest to the smallest mass.
//
// Without matrices nothing is worked out or proven that is not O(nv). With them the proof of X
// takes nv^3 operations.
//
// `singular` is no theorem: it says that with `digits` digits D cannot be told from zero.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "accuracy/truth/task.hpp"
#include "algorithms/model/model.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

// Proven: 0 where it was not asked for.
struct AnswerWidths {
  double M = 0, X = 0, D = 0, g = 0;
};

template <class T>
struct Truth {
  Outcome outcome;     // not ok: no inverse at any precision within the limit; the rest is empty
  MatrixX<Real> M, X;  // nv x nv
  VectorX<Real> D;     // nv
  MatrixX<Real> g;     // 6 x nv
  std::vector<Response<T>> responses;  // one a task
  unsigned digits = 0;                 // carried
  AnswerWidths width;

  // The largest of those in (1).
  double largest_width() const;
};

struct TruthOptions {
  unsigned digits = 1000;
  bool matrices = true;  // false: M, X, D and g stay empty
  int draws = 0;         // for kS of every task; 0: none
};

// Why there is no truth, in words with the numbers.
struct NoTruth : std::runtime_error {
  enum class Why {
    digits,  // (1) cannot be proven within the digits
    range,   // a parameter, or the torque of a task, is beyond the range of T
  };

  Why why;

  NoTruth(Why reason, const std::string& what) : std::runtime_error(what), why(reason) {}
};

// q: nq values. T: float or double. Throws NoTruth.
template <class T>
Truth<T> truth(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
               const TruthOptions& options = {});

}  // namespace kalmarm
