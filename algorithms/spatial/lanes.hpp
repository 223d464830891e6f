// Row-major arrays to packs and back. The array has one row per state; pack j holds number j of n
// states.
//
// Tiles of n x n numbers are transposed in registers; the last tile of a row ends with the row. A
// row shorter than a tile is read and written together with the start of the next rows. Rows are
// written in order, so the next rows then overwrite that with their own numbers. Nothing outside
// the n rows is written, and nothing outside the array is read.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

// From `states` rows, n or fewer, of `left` that are left in the array. Lanes without a row repeat
// the last.
template <class S, int n>
void to_lanes(const S* rows, int width, int states, int left, std::vector<Pack<S, n>>& packs) {
  using P = Pack<S, n>;
  const bool readable = (n - 1) * width + std::max(n, width) <= left * width;
  if (states == n && readable) {
    for (int j = 0; j < width; j += n) {
      const int first = std::max(0, std::min(j, width - n)), end = std::min(n, width);
      P tile[n];
      for (int i = 0; i < n; ++i) tile[i] = P::load(rows + i * width + first);
      transpose(tile);
      for (int i = 0; i < end; ++i) packs[first + i] = tile[i];
    }
    return;
  }
  for (int j = 0; j < width; ++j) {
    std::array<S, n> lanes;
    for (int i = 0; i < n; ++i) lanes[i] = rows[std::min(i, states - 1) * width + j];
    packs[j] = P::load(lanes.data());
  }
}

// To `states` rows, n or fewer.
template <class S, int n>
void from_lanes(const std::vector<Pack<S, n>>& packs, int width, int states, S* rows) {
  using P = Pack<S, n>;
  if (states < n) {
    for (int j = 0; j < width; ++j)
      for (int i = 0; i < states; ++i) rows[i * width + j] = packs[j][i];
    return;
  }
  for (int j = 0; j < width; j += n) {
    const int first = std::max(0, std::min(j, width - n)), end = std::min(n, width);
    P tile[n];
    for (int i = 0; i < n; ++i) tile[i] = i < end ? packs[first + i] : P(S(0));
    transpose(tile);
    for (int i = 0; i < n; ++i) {
      S* row = rows + i * width + first;
      if (i * width + first + n <= n * width)
        tile[i].store(row);
      else
        for (int l = 0; l < end; ++l) row[l] = tile[i][l];
    }
  }
}

}  // namespace kalmarm
