// A symmetric matrix, column-major, computed with one column per SIMD lane.
//
// Only the lower triangle is computed; the upper one is its mirror image, so that both agree to the
// last bit. Columns are taken in chunks of one register. Chunks are counted from the last column,
// so that only the first may be short: what its spare lanes write belongs to the next chunk, which
// is written later. Squares of n x n numbers are mirrored in registers.
#pragma once

#include <algorithm>
#include <cstddef>

#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

// f(first, count) of every chunk of columns, the first one first; it may have less than n.
template <class F>
void for_each_chunk(int columns, int n, const F& f) {
  const int rest = columns % n;
  if (rest > 0) f(0, rest);
  for (int first = rest; first < columns; first += n) f(first, n);
}

// X[to + i] = x[i], but nothing from X[end] on.
template <class T, class S>
KALMARM_INLINE void store_before(std::ptrdiff_t end, const T& x, std::ptrdiff_t to, S* X) {
  if (to + Lanes<T>::count <= end)
    x.store(X + to);
  else
    for (int i = 0; to + i < end; ++i) X[to + i] = x[i];
}

// X(first + i, k) = x[i]. Lanes that are more than there are rows go to the next column, which is
// written after this one, and nowhere from the last.
template <class T, class S>
KALMARM_INLINE void store_rows(const T& x, int first, int k, int n, S* X) {
  const std::ptrdiff_t column = n;
  store_before(column * n, x, k * column + first, X);
}

namespace detail {

// The square below the diagonal at (row, column), mirrored.
template <class P, class S>
KALMARM_INLINE void mirror_square(int row, int column, int n, S* X) {
  constexpr int lanes = Lanes<P>::count;
  P square[lanes];
  for (int j = 0; j < lanes; ++j)
    square[j] = P::load(X + static_cast<std::ptrdiff_t>(column + j) * n + row);
  transpose(square);
  for (int i = 0; i < lanes; ++i)
    square[i].store(X + static_cast<std::ptrdiff_t>(row + i) * n + column);
}

template <class S>
void mirror_triangle(int first, int end, int n, S* X) {
  for (int j = first; j < end; ++j)
    for (int i = j + 1; i < end; ++i)
      X[static_cast<std::ptrdiff_t>(i) * n + j] = X[static_cast<std::ptrdiff_t>(j) * n + i];
}

}  // namespace detail

// The upper triangle of X (n x n) becomes the mirror image of the lower one. Squares are 32 bytes
// wide: wider ones cross lines of the cache wherever they begin.
template <class S>
void mirror(int n, S* X) {
  constexpr int lanes = 32 / sizeof(S);
  using P = Pack<S, lanes>;
  const int rest = n % lanes, corner = rest == 0 ? 0 : std::min(n, rest + lanes);
  detail::mirror_triangle(0, corner, n, X);
  for (int row = corner; row < n; row += lanes) {
    if (rest > 0) detail::mirror_square<P>(row, 0, n, X);
    for (int column = rest; column < row; column += lanes)
      detail::mirror_square<P>(row, column, n, X);
    detail::mirror_triangle(row, row + lanes, n, X);
  }
}

}  // namespace kalmarm
