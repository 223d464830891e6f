// Rows of contacts on their way to the base, beside P0 of the robot alone: of one state eight rows in the lanes of a
// pack, of one state in every lane a pack for each row.
//
//   P = P0 + sum of w w'                                                                        (1)
// At a joint, with U = P0 H', D0 = H U + r and g0 = U / D0:
//   a reflection of the rows leaves one of them, w, with w_h = H w other than zero              (2)
//   D = D0 + w_h^2,  g = (D0 g0 + w_h w) / D                                                    (3)
//   P0+ = P0 - U g0',  w+ = sqrt(D0 / D) (w - w_h g0),  the other rows as they are              (4)
// exactly, since w+ w+' = w w' + U g0' - D g g'. Rows go to the parent as forces do; where more than six meet,
// reflections make six of them. (2) to (4) take about 26 flops a row and 60, phi 30 a row.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "algorithms/fast/covariance/rounding_test.hpp"
#include "algorithms/fast/kinematics/moves.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

template <class T>
class ResistingRows {
  using S = typename Lanes<T>::Scalar;
  static constexpr bool side_by_side = std::is_floating_point_v<T>;
  static constexpr int lanes = side_by_side ? 8 : 1;
  using Block = std::conditional_t<side_by_side, Pack<T, side_by_side ? 8 : 1>, T>;

 public:
  static constexpr int most = 6;  // that a link hands on

  bool any() const { return count_ > 0; }
  void clear() { count_ = 0; }

  // Of any number, since what does not fit is made six at once.
  void add(const Sixfold<T>& row) {
    if (count_ == capacity) compress();
    const int at = count_ / lanes, lane = count_ % lanes;
    if (side_by_side && lane == 0) detail::set_zero(w_[at]);
    for (int j = 0; j < 6; ++j) set(entry(w_[at], j), lane, entry(row, j));
    ++count_;
  }
  void compress() {
    if (count_ <= most) return;
    for (int j = 0; j < most; ++j) leave_one(j, j);
    count_ = most;
  }
  // Each of them is added to `to`.
  void add_to(std::vector<Sixfold<T>>& to) const {
    for (int i = 0; i < count_; ++i) {
      Sixfold<T>& row = to.emplace_back();
      for (int j = 0; j < 6; ++j) entry(row, j) = get(entry(w_[i / lanes], j), i % lanes);
    }
  }

  // (2) to (4) at a joint: g and 1/D, which are those of P0, become those of P.
  template <bool slides, bool noise>
  KALMARM_NOINLINE void measure(Sixfold<T>& g, T& inverse_D) {
    using std::sqrt;
    constexpr int h = slides ? 5 : 2;
    leave_one(h, 0);
    const T w_h = get(entry(w_[0], h), 0), D0 = T(S(1)) / inverse_D;
    inverse_D = T(S(1)) / (D0 + w_h * w_h);
    const T kept = D0 * inverse_D, share = w_h * inverse_D, root = sqrt(kept);
    for (int j = 0; j < 6; ++j) {
      Block& w = entry(w_[0], j);
      const T g0 = entry(g, j), w_j = get(w, 0);
      entry(g, j) = kept * g0 + share * w_j;
      set(w, 0, root * (w_j - w_h * g0));
    }
    if constexpr (!noise) {
      entry(g, h) = T(S(1));
      set(entry(w_[0], h), 0, T(S(0)));
    }
  }

  // f of all rows: of a Sixfold of one, or of several side by side.
  template <class F>
  KALMARM_INLINE void move(const F& f) {
    for (int b = 0; b < blocks(); ++b) f(w_[b]);
  }

 private:
  static constexpr int capacity = 16;

  template <class X>
  KALMARM_INLINE static auto& entry(X& w, int j) {
    static_assert(sizeof w == 6 * sizeof w.x);
    return (&w.x)[j];
  }
  KALMARM_INLINE static T get(const Block& x, int lane) {
    if constexpr (side_by_side)
      return x[lane];
    else
      return x;
  }
  KALMARM_INLINE static void set(Block& x, int lane, const T& value) {
    if constexpr (side_by_side)
      x.set(lane, value);
    else
      x = value;
  }
  KALMARM_INLINE static T over_lanes(const Block& x) {
    if constexpr (side_by_side)
      return sum(x);
    else
      return x;
  }

  int blocks() const { return (count_ + lanes - 1) / lanes; }

  // (2), of rows `first` and on, whose entries before `first` are zero: row `first` alone has an entry at h.
  KALMARM_INLINE void leave_one(int h, int first) {
    if (count_ - first < 2) return;
    const int from = first / lanes, end = blocks();
    if constexpr (!side_by_side) {
      if (from == 0 && end == most) return reflect<most>(h, first, 0, most);
    }
    reflect<0>(h, first, from, end);
  }

  // number: of blocks, where it is a constant.
  template <int number>
  KALMARM_INLINE void reflect(int h, int first, int from, int end) {
    using detail::zero_where_less, std::sqrt;
    if constexpr (number > 0) from = 0, end = number;
    Block v[capacity / lanes];
    T squares = T(S(0));
    for (int b = from; b < end; ++b) {
      v[b] = entry(w_[b], h);
      if (side_by_side && b == from)
        for (int lane = 0; lane < first % lanes; ++lane) set(v[b], lane, T(S(0)));
      squares += over_lanes(v[b] * v[b]);
    }
    const T size = sqrt(squares), own = get(v[from], first % lanes);
    const T signed_size = T(S(2)) * zero_where_less(own, T(S(0)), size) - size;
    for (int b = from; b < end; ++b) entry(w_[b], h) -= v[b];
    set(entry(w_[from], h), first % lanes, -signed_size);
    // v of 1 - v v' / (v'v / 2); its first entry does not cancel.
    set(v[from], first % lanes, own + signed_size);
    const T half = squares + signed_size * own;
    const T by = zero_where_less(half, T(std::numeric_limits<S>::min()), T(T(S(1)) / half));
    for (int j = first; j < 6; ++j) {
      if (j == h) continue;
      T along = T(S(0));
      for (int b = from; b < end; ++b) along += over_lanes(v[b] * entry(w_[b], j));
      along = along * by;
      for (int b = from; b < end; ++b) entry(w_[b], j) -= v[b] * Block(along);
    }
  }

  int count_ = 0;
  Sixfold<Block> w_[capacity / lanes];
};

}  // namespace kalmarm
