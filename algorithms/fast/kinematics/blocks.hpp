// A symmetric matrix of a long chain, column-major, whose entries off the diagonal have rank 6:
//
//   X(m,j) = N(m)' Phi(m+1) ... Phi(j-1) Z(j),  m < j          Phi(k): from link k to link k - 1
// By blocks I of 16 links with AVX-512, else of 8, the first perhaps of less:
//   rows(I)  = N(m)' Phi(m+1) ... to the last link of I
//   Phi(I)   = Phi(first) ... Phi(last), 6 x 6
//   Z(J)     = Phi(first) ... Phi(j-1) Z(j), at the link before J
//   X(I,J)   = rows(I) Z(J),  Z(J) <- Phi(I) Z(J)    for I = J - 1, J - 2, ...
// 12 flops for an entry of either triangle, 5 for Phi(I) Z(J), and within a block about 30 for
// each of 3 numbers a link and lane. The upper triangle is the mirror image of the lower one, or is
// left out.
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "algorithms/fast/kinematics/column_lanes.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {

// Whether the model is a chain (every parent is k - 1) of at least `links` links.
template <class S>
bool is_chain(const LoweredModel<S>& model, int links) {
  for (int k = 1; k < model.nv(); ++k)
    if (!model.link(k).hangs_on_previous) return false;
  return model.nv() >= links;
}

template <class S>
class Blocks {
 public:
  // A register of float, two of double; the six columns of Phi have room.
  static constexpr int size = std::max(Lanes<WidePack<float>>::count, 8);

  Blocks(int links, Triangles triangles)
      : mirrors_(triangles == Triangles::both),
        rows_((links + size - 1) / size),
        Phi_(rows_.size()) {}

  // chain has
  //   N(k), Phi_times(k, v): v <- Phi(k)' v, to link k from link k - 1
  //   enter(k, own, z): returns X(k, lanes), z of link k becomes z of link k - 1 where there is one
  // with z and v of lanes; `own` is 1 in the lane of column k.
  template <class Chain>
  void fill(const Chain& chain, int n, S* X) {
    int J = 0;
    for_each_chunk(n, size, [&](int first, int count) {
      set_rows(chain, first, count, J);
      if (first > 0) set_Phi(chain, first, count, J);
      Sixfold<Lane> Z;
      diagonal_block(chain, first, count, n, X, Z);
      for (int I = J - 1; I >= 0; --I) {
        const int end = first - (J - 1 - I) * size, row = std::max(0, end - size);
        if (I > 0) {
          const int next = std::max(0, row - size);
          prefetch(next, first, n, X);
          if (mirrors_) prefetch(first, next, n, X);
        }
        multiply(rows_[I], Z, row, end - row, first, n, X);
        if (I > 0) advance(Phi_[I], Z);
      }
      ++J;
    });
  }

 private:
  using Part = WidePack<S>;
  using Lane = Pack<S, size>;
  static constexpr int part = Lanes<Part>::count, parts = size / part;

  // N(m)' ... of one number each, by component.
  struct Rows {
    alignas(64) S at[6][size];
  };

  template <class T>
  static void keep(const Sixfold<T>& v, Rows& rows) {
    v.x.store(rows.at[0]);
    v.y.store(rows.at[1]);
    v.z.store(rows.at[2]);
    v.u.store(rows.at[3]);
    v.v.store(rows.at[4]);
    v.w.store(rows.at[5]);
  }

  template <class Chain>
  void set_rows(const Chain& chain, int first, int count, int I) {
    Sixfold<Lane> v;
    detail::set_zero(v);
    for (int k = first; k < first + count; ++k) {
      if (k > first) chain.Phi_times(k, v);
      const Sixfold<S> N = chain.N(k);
      const Lane own = detail::Unit<Lane>::lane(k - first);
      v.x += own * N.x;
      v.y += own * N.y;
      v.z += own * N.z;
      v.u += own * N.u;
      v.v += own * N.v;
      v.w += own * N.w;
    }
    keep(v, rows_[I]);
  }

  // Row c of Phi(I) is the unit vector c at the link before I, brought to its last.
  template <class Chain>
  void set_Phi(const Chain& chain, int first, int count, int I) {
    using Six = Pack<S, 8>;
    Sixfold<Six> v = {detail::Unit<Six>::lane(0), detail::Unit<Six>::lane(1),
                      detail::Unit<Six>::lane(2), detail::Unit<Six>::lane(3),
                      detail::Unit<Six>::lane(4), detail::Unit<Six>::lane(5)};
    for (int k = first; k < first + count; ++k) chain.Phi_times(k, v);
    keep(v, Phi_[I]);
  }

  template <class Chain>
  void diagonal_block(const Chain& chain, int first, int count, int n, S* X, Sixfold<Lane>& Z) {
    Sixfold<Lane> z;
    detail::set_zero(z);
    for (int k = first + count - 1; k >= first; --k)
      store_rows(chain.enter(k, detail::Unit<Lane>::lane(k - first), z), first, k, n, X);
    if (mirrors_) detail::mirror_triangle(first, first + count, n, X);
    detail::assign(Z, z);
  }

  // Prefetches the cache lines of `size` columns from a row on: otherwise store misses, one after
  // another, take most of the time.
  static void prefetch(int column, int row, int n, const S* X) {
    for (int j = 0; j < size; ++j) {
      const S* const from = X + std::ptrdiff_t(column + j) * n + row;
      __builtin_prefetch(from, 1);
      if (parts > 1) __builtin_prefetch(from + part, 1);
      __builtin_prefetch(from + size - 1, 1);
    }
  }

  // X(I,J) for the rows from `row` on, and its mirror image.
  void multiply(const Rows& N, const Sixfold<Lane>& Z, int row, int height, int column, int n,
                S* X) const {
    for (int m = 0; m < height; m += part) {
      Part square[parts][part];
      for (int i = 0; i < part; ++i) {
        const Lane x = (Z.x * N.at[0][m + i] + Z.y * N.at[1][m + i] + Z.z * N.at[2][m + i]) +
                       (Z.u * N.at[3][m + i] + Z.v * N.at[4][m + i] + Z.w * N.at[5][m + i]);
        for (int j = 0; j < parts; ++j) square[j][i] = piece<part>(x, j);
      }
      const int rows = std::min(part, height - m);
      for (int i = 0; i < rows; ++i)
        for (int j = 0; j < parts; ++j)
          square[j][i].store(X + std::ptrdiff_t(row + m + i) * n + column + j * part);
      if (!mirrors_) continue;
      for (int j = 0; j < parts; ++j) {
        transpose(square[j]);
        for (int i = 0; i < part; ++i) {
          S* const to = X + std::ptrdiff_t(column + j * part + i) * n + row + m;
          if (rows == part)
            square[j][i].store(to);
          else
            for (int l = 0; l < rows; ++l) to[l] = square[j][i][l];
        }
      }
    }
  }

  static void advance(const Rows& Phi, Sixfold<Lane>& Z) {
    const auto row = [&](int c) {
      return without_tiny((Z.x * Phi.at[0][c] + Z.y * Phi.at[1][c] + Z.z * Phi.at[2][c]) +
                          (Z.u * Phi.at[3][c] + Z.v * Phi.at[4][c] + Z.w * Phi.at[5][c]));
    };
    const Lane x = row(0), y = row(1), z = row(2), u = row(3), v = row(4), w = row(5);
    Z.x = x;
    Z.y = y;
    Z.z = z;
    Z.u = u;
    Z.v = v;
    Z.w = w;
  }

  bool mirrors_;
  std::vector<Rows> rows_, Phi_;
};

}  // namespace kalmarm
