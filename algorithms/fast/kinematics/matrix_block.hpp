// Symmetric matrices of one state in every lane of P: a kernel sets them entry by entry, and when all
// entries are there the lanes are transposed to one matrix after another (lanes.hpp).
#pragma once

#include <cstddef>
#include <vector>

#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

template <class P>
class MatrixBlock {
  using S = typename Lanes<P>::Scalar;

 public:
  // Whether a matrix of n rows is worked out faster here than state by state.
  static constexpr bool takes(int n) { return n <= most_rows_in_lanes; }

  explicit MatrixBlock(int n) : n_(n), entries_(static_cast<std::size_t>(n) * n) {}

  // Entries (i,j) and (j,i).
  KALMARM_INLINE void set(int i, int j, const P& x) {
    entries_[i * n_ + j] = x;
    entries_[j * n_ + i] = x;
  }

  // X: n x n numbers for each of so many states, at most as many as there are lanes.
  void store(int states, S* X) const { from_lanes(entries_, n_ * n_, states, X); }

 private:
  int n_;
  std::vector<P> entries_;
};

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

}  // namespace kalmarm
