// Columns of a symmetric matrix in lanes: their memory, the links that each needs, and unit vectors.
#pragma once

#include <array>
#include <vector>

#include "algorithms/fast/kinematics/lower_triangle.hpp"
#include "algorithms/fast/kinematics/placements.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

template <class T>
struct ColumnsWorkspace {
  struct Branch {
    Sixfold<T> z, l;
  };

  std::vector<T> e;
  std::vector<Branch> branches;

  template <class S>
  explicit ColumnsWorkspace(const LoweredModel<S>& model)
      : e(model.nv()), branches(model.branch_count()) {}
};

// Of every chunk of columns (lower_triangle.hpp) the links between them and the base.
class ColumnPaths {
 public:
  template <class Lowered>
  ColumnPaths(const Lowered& model, int columns, int lanes) {
    for_each_chunk(columns, lanes, [&](int first, int count) {
      std::vector<char>& path = paths_.emplace_back(model.nv(), 0);
      for (int k = first + count - 1; k >= 0; --k) {
        if (k >= first) path[k] = 1;
        if (path[k] && model.link(k).parent >= 0) path[model.link(k).parent] = 1;
      }
    });
  }

  const char* operator[](int chunk) const { return paths_[chunk].data(); }

 private:
  std::vector<std::vector<char>> paths_;
};

namespace detail {

// 1 in lane i, if there is one.
template <class T>
struct Unit {
  static T lane(int i) { return T(i == 0 ? 1 : 0); }
};
template <class S, int n>
struct Unit<Pack<S, n>> {
  KALMARM_INLINE static Pack<S, n> lane(int i) {
    static constexpr auto one_among_zeros = [] {
      std::array<S, 2 * n + 1> numbers{};
      numbers[n] = S(1);
      return numbers;
    }();
    return Pack<S, n>::load(&one_among_zeros[n - (i < 0 ? -1 : i < n ? i : n)]);
  }
};

// What is worked out at once: n columns of one state, or, where T has a state in every lane, one of each.
template <class T, int n>
struct ColumnsOf {
  using Lane = Pack<T, n>;
  static constexpr int count = n;

  KALMARM_INLINE static Lane unit(int i) { return Unit<Lane>::lane(i); }  // 1 in column i
  KALMARM_INLINE static T column(const Lane& x, int i) { return x[i]; }
};
template <class S, int states, int n>
struct ColumnsOf<Pack<S, states>, n> {
  using Lane = Pack<S, states>;
  static constexpr int count = 1;

  KALMARM_INLINE static Lane unit(int i) { return Lane(S(i == 0)); }
  KALMARM_INLINE static const Lane& column(const Lane& x, int) { return x; }
};

}  // namespace detail

}  // namespace kalmarm
