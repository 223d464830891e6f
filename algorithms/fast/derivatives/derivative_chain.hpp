// Columns of M^-1, da/dq and da/dq' for a chain of hinges and slides, in tiles.
//
// A block is `lanes` joints. Its response is linear in the force z at its outboard end and in the
// acceleration l and the turn b at its inboard end:
//   inboard   y = N z,  z <- Phi z,  and l = -Upsilon z at its outboard end                  (C1)
//   outboard  y = R (l; b),  l <- A (l; b)                                                   (C2)
// N is lanes x 6, R lanes x 9, Phi 6x6, A 6x9: the sweeps of derivative_columns.hpp on columns of
// the identity. -Upsilon gives the acceleration that returns for a force sent inward, so a block's
// columns need sweeps within that block alone, and matrix products elsewhere:
//   rows of block I < J: N(I) z(J), z(J) <- Phi(I) z(J);  I > J: R(I) (l; b), l <- A(I) (l; b)
// The products Phi and A are kept as matrices: I - gH is a projector, so they are singular and no
// quotient of vectors at both ends can replace them. A tile of 8 x 8 takes 84 multiply-adds of a
// register inboard and 126 outboard; the sweeps take 260 and 150, each waiting for the one before.
#pragma once

#include <vector>

#include "algorithms/fast/derivatives/derivative_columns.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class T>
struct ChainBlocks {
  static constexpr int lanes = lanes_of<T>;
  using Signal = T[9][lanes];  // z, or l and b, of a block's columns

  struct Block {
    Wide<T> N[6], R[9];
    T Phi[6][lanes], minus_Upsilon[6][lanes], A_l[6][lanes], A_b[6][lanes];
  };

  AlignedVector<Block> blocks;

  // Empty where the model is no chain, or a short one: then the sweeps are faster.
  template <class S>
  explicit ChainBlocks(const LoweredModel<S>& model) {
    bool tiles = lanes >= 8 && model.nv() > 2 * lanes;
    for (int k = 0; k < model.nv(); ++k)
      tiles = tiles && model.link(k).coordinate != Coordinate::quaternion &&
              (k == 0 || model.link(k).hangs_on_previous);
    if (tiles) blocks.resize((model.nv() + lanes - 1) / lanes);
  }
};

namespace detail {

template <class T>
KALMARM_INLINE void put(const Sixfold<Wide<T>>& x, T (*to)[lanes_of<T>]) {
  store(x.x, to[0]);
  store(x.y, to[1]);
  store(x.z, to[2]);
  store(x.u, to[3]);
  store(x.v, to[4]);
  store(x.w, to[5]);
}
template <class T>
KALMARM_INLINE void put(const Triple<Wide<T>>& x, T (*to)[lanes_of<T>]) {
  store(x.x, to[0]);
  store(x.y, to[1]);
  store(x.z, to[2]);
}
template <class T>
KALMARM_INLINE Sixfold<Wide<T>> get(const T (*from)[lanes_of<T>]) {
  return {load(from[0]), load(from[1]), load(from[2]), load(from[3]), load(from[4]), load(from[5])};
}

// Row i of a 6 x n matrix times n signals.
template <int n, class T>
KALMARM_INLINE Wide<T> row_times(const T* row, const T (*x)[lanes_of<T>]) {
  using W = Wide<T>;
  W sum = W(row[0]) * load(x[0]);
  for (int j = 1; j < n; ++j) sum += W(row[j]) * load(x[j]);
  return sum;
}

// Matrix times signals.
template <class T>
KALMARM_INLINE Sixfold<Wide<T>> times(const T (*A)[lanes_of<T>], const T (*x)[lanes_of<T>]) {
  return {row_times<6>(A[0], x), row_times<6>(A[1], x), row_times<6>(A[2], x),
          row_times<6>(A[3], x), row_times<6>(A[4], x), row_times<6>(A[5], x)};
}

template <class T>
KALMARM_INLINE void put_without_tiny(const Sixfold<Wide<T>>& x, T (*to)[lanes_of<T>]) {
  put<T>({without_tiny(x.x), without_tiny(x.y), without_tiny(x.z), without_tiny(x.u),
          without_tiny(x.v), without_tiny(x.w)},
         to);
}

// The rows of a block for its columns' signals, a register of rows for every column.
template <int rank, class T>
KALMARM_INLINE void tile_of(const Wide<T>* rows, const T (*x)[lanes_of<T>], Wide<T>* tile) {
  using W = Wide<T>;
  for (int j = 0; j < lanes_of<T>; ++j) {
    W sum = rows[0] * W(x[0][j]);
    for (int i = 1; i < rank; ++i) sum += rows[i] * W(x[i][j]);
    tile[j] = sum;
  }
}

// (C1) and (C2) of every block.
template <class T, class S>
void set_blocks(const LoweredModel<S>& model, const DerivativeTerms<T>& terms,
                DerivativeColumns<T>& ws, ChainBlocks<T>& chain) {
  using W = Wide<T>;
  constexpr int lanes = lanes_of<T>;
  static_assert(lanes == 1 || lanes >= 6);
  const auto unit = [&](int i) { return load(&ws.unit[i * lanes]); };
  const Sixfold<W> identity = {unit(0), unit(1), unit(2), unit(3), unit(4), unit(5)};
  const W zero = W(0);
  for (int i = 0; i < static_cast<int>(chain.blocks.size()); ++i) {
    auto& block = chain.blocks[i];
    const int first = i * lanes, end = std::min(first + lanes, model.nv());
    typename DerivativeColumns<T>::Inward z;
    typename DerivativeColumns<T>::Outward l;
    z.m = identity;
    z.q = z.v = nothing<W>();
    sweep_inward<false>(model, terms, i, first, end, ws, z);
    put<T>(z.m, block.Phi);
    l.m = i == 0 ? nothing<W>() : times<T>(chain.blocks[i - 1].minus_Upsilon, block.Phi);
    l.q = identity;
    l.v = nothing<W>();
    l.b_q = {zero, zero, zero};
    l.b_v = {unit(0), unit(1), unit(2)};
    sweep_outward<false, true>(model, terms, i, first, end, ws, l);
    put<T>(l.m, block.minus_Upsilon);
    put<T>(l.q, block.A_l);
    put<T>(l.v, block.A_b);
    const auto rows = [&](Wide<T> DerivativeColumns<T>::Row::*part, int count, W* out) {
      W tile[lanes];
      for (int k = 0; k < lanes; ++k) tile[k] = ws.rows[std::min(first + k, end - 1)].*part;
      turn_tile<T>(tile);
      for (int j = 0; j < count; ++j) out[j] = tile[j];
    };
    using Row = typename DerivativeColumns<T>::Row;
    rows(&Row::m, 6, block.N);
    rows(&Row::q, 6, block.R);
    rows(&Row::v, 3, block.R + 6);
  }
}

// A block's columns of the chain.
template <class T, class S>
void chain_columns(const LoweredModel<S>& model, const DerivativeTerms<T>& terms, int block,
                   const ChainBlocks<T>& chain, DerivativeColumns<T>& ws, T* da_dq, T* da_dqd,
                   T* da_dtau) {
  using W = Wide<T>;
  using Row = typename DerivativeColumns<T>::Row;
  constexpr int lanes = lanes_of<T>;
  const int nv = model.nv(), first = block * lanes, end = std::min(first + lanes, nv);
  const int columns = std::min(lanes, nv - first);
  alignas(64) typename ChainBlocks<T>::Signal m, q, v;
  typename DerivativeColumns<T>::Inward z;
  typename DerivativeColumns<T>::Outward l;
  z.m = z.q = z.v = nothing<W>();
  sweep_inward<true>(model, terms, block, first, end, ws, z);
  put<T>(z.m, m);
  put<T>(z.q, q);
  put<T>(z.v, v);
  if (block > 0) {
    const auto& inboard = chain.blocks[block - 1].minus_Upsilon;
    l.m = times<T>(inboard, m);
    l.q = times<T>(inboard, q);
    l.v = times<T>(inboard, v);
  }
  l.b_q = l.b_v = {W(0), W(0), W(0)};
  sweep_outward<true, true>(model, terms, block, first, end, ws, l);
  write_diagonal(ws, block, nv, da_dtau);
  write_columns(ws, &Row::q, block, first, end, nv, da_dq);
  write_columns(ws, &Row::v, block, first, end, nv, da_dqd);

  W tile[lanes];
  for (int i = block - 1; i >= 0; --i) {
    const auto& at = chain.blocks[i];
    const int row = i * lanes;
    const auto whole = [&](T* out) {
      for (int j = 0; j < columns; ++j) store(tile[j], out + (first + j) * nv + row);
    };
    tile_of<6, T>(at.N, q, tile);
    whole(da_dq);
    tile_of<6, T>(at.N, v, tile);
    whole(da_dqd);
    tile_of<6, T>(at.N, m, tile);
    whole(da_dtau);
    if (i == 0) break;
    put_without_tiny<T>(times<T>(at.Phi, m), m);
    put_without_tiny<T>(times<T>(at.Phi, q), q);
    put_without_tiny<T>(times<T>(at.Phi, v), v);
  }
  put<T>(l.q, q);
  put<T>(l.b_q, q + 6);
  put<T>(l.v, v);
  put<T>(l.b_v, v + 6);
  for (int i = block + 1; i < static_cast<int>(chain.blocks.size()); ++i) {
    const auto& at = chain.blocks[i];
    const int row = i * lanes, rows = std::min(lanes, nv - row);
    const auto some = [&](T* out) {
      for (int j = 0; j < columns; ++j)
        store_some(tile[j], rows, true, out + (first + j) * nv + row);
    };
    tile_of<9, T>(at.R, q, tile);
    some(da_dq);
    tile_of<9, T>(at.R, v, tile);
    some(da_dqd);
    const auto carry = [&](T(*x)[lanes]) {
      Sixfold<W> next = times<T>(at.A_l, x);
      add(next, {row_times<3>(at.A_b[0], x + 6), row_times<3>(at.A_b[1], x + 6),
                 row_times<3>(at.A_b[2], x + 6), row_times<3>(at.A_b[3], x + 6),
                 row_times<3>(at.A_b[4], x + 6), row_times<3>(at.A_b[5], x + 6)});
      put_without_tiny<T>(next, x);
    };
    carry(q);
    carry(v);
  }
}

}  // namespace detail

}  // namespace kalmarm
