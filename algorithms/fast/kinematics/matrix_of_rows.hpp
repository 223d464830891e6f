// Symmetric matrices of one state in every lane of P, by their columns: one of every state in the lanes of
// P, or two in the halves of a pack twice as wide. Two at once hide the latency of a sweep, each step of
// which depends on the one before. A kernel has what a column is (M: mass_of_rows.hpp, M^-1:
// inverse_of_rows.hpp); the upper triangle is the mirror image of the lower one.
#pragma once

#include <cstddef>
#include <vector>

#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/fast/kinematics/column_lanes.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

namespace detail {

// One column of every state in the lanes of T = P, or two in the halves of a pack twice as wide.
template <class T, class P>
struct ColumnsOfStates;

template <class P>
struct ColumnsOfStates<P, P> {
  static constexpr int count = 1;
  KALMARM_INLINE static P unit(int i) { return P(typename Lanes<P>::Scalar(i == 0)); }
  KALMARM_INLINE static const P& column(const P& x, int) { return x; }
};

template <class P>
struct ColumnsOfStates<Pack<typename Lanes<P>::Scalar, 2 * Lanes<P>::count>, P> {
  using S = typename Lanes<P>::Scalar;
  using T = Pack<S, 2 * Lanes<P>::count>;
  static constexpr int count = 2;
  KALMARM_INLINE static T unit(int i) { return {P(S(i == 0)), P(S(i == 1))}; }
  KALMARM_INLINE static const P& column(const T& x, int i) { return i == 0 ? x.low : x.high; }
};

}  // namespace detail

template <class P>
class MatrixOfRows {
 public:
  // Whether a matrix of n rows is worked out faster here than state by state.
  static constexpr bool takes(int n) { return n <= most_rows_in_lanes; }

 protected:
  using S = typename Lanes<P>::Scalar;
  using Two = Pack<S, 2 * Lanes<P>::count>;
  explicit MatrixOfRows(const LoweredModel<S>& model)
      : n_(model.nv()),
        q_(model.nq()),
        entries_(static_cast<std::size_t>(n_) * n_),
        one_(model),
        two_(model),
        paths_(model, n_, 2) {}

  const P* load(const S* q, int states, int left) {
    to_lanes(q, static_cast<int>(q_.size()), states, left, q_);
    return q_.data();
  }

  // X, n x n numbers for each of so many states. sweep(first, last, path, ws, set) calls set(k, x) with
  // entries (k, first) and, of two columns, (k, last), of all k <= last. Returns 0 in the lanes of which
  // all is finite, else NaN.
  template <class Sweep>
  P fill_columns(int states, S* X, const Sweep& sweep) {
    P check = P(S(0));
    int i = 0;
    for_each_chunk(n_, 2, [&](int first, int count) {
      const char* const path = paths_[i++];
      check += count == 1 ? columns(first, path, one_, sweep) : columns(first, path, two_, sweep);
    });
    from_lanes(entries_, n_ * n_, states, X);
    return check;
  }

 private:
  template <class T, class Sweep>
  P columns(int first, const char* path, ColumnsWorkspace<T>& ws, const Sweep& sweep) {
    using Columns = detail::ColumnsOfStates<T, P>;
    const int last = first + Columns::count - 1;
    T check = T(S(0));
    sweep(first, last, path, ws, [&](int k, const T& x) {
      check += x * T(S(0));
      for (int i = k == last ? Columns::count - 1 : 0; i < Columns::count; ++i) {
        const P& entry = Columns::column(x, i);
        entries_[k * n_ + first + i] = entry;
        entries_[(first + i) * n_ + k] = entry;
      }
    });
    P sum = Columns::column(check, 0);
    if constexpr (Columns::count == 2) sum += Columns::column(check, 1);
    return sum;
  }

  int n_;
  std::vector<P> q_, entries_;
  ColumnsWorkspace<P> one_;
  ColumnsWorkspace<Two> two_;
  ColumnPaths paths_;
};

}  // namespace kalmarm
