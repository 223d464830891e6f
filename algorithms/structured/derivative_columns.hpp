// Columns of M^-1, da/dq and da/dq', a register's width of columns at once: lane j of every number
// is that of column j.
//
// A unit torque, or the x of (B3), goes inward through the filter and comes back outward as an
// acceleration l; outboard of j turns what a turn of everything there turns with it, b:
//   inward   z- = sum of phi z+, and x(j) at k = j
//            e = (1 at k = j) - H z-  for M^-1,  -H z-  for the others;   z+ = z- + g e   (4.2), (4.5)
//   outward  l+ = phi' l-,  y(k) = e / D - g'l+ - q'b,  l- = l+ + H'y                     (4.9), (4.11)
//            and at k = j: l- += chi, b = psi_w for dq;  l- += (v- + v+) x H, b = H_w for dq'
// y is the column. Lanes that have not begun hold zeros, so branches need no masks: what a branch
// adds is saved where the tree branches. 15 numbers in and 16 to 19 out a link and register.
#pragma once

#include <array>
#include <vector>

#include "algorithms/structured/derivative_terms.hpp"

namespace kalmarm {

template <class T>
struct DerivativeColumns {
  using W = Wide<T>;
  static constexpr int lanes = lanes_of<T>;

  struct Row {
    W m, q, v;  // of M^-1, da/dq, da/dq'
  };
  struct Inward {
    Sixfold<W> m, q, v;
  };
  struct Outward {
    Sixfold<W> m, q, v;
    Triple<W> b_q, b_v;
  };

  AlignedVector<Row> rows;  // e, then y, of every link
  std::vector<Inward, Eigen::aligned_allocator<Inward>> inward;  // of links with branches
  std::vector<Outward, Eigen::aligned_allocator<Outward>> outward;
  std::vector<bool> carries;       // link k is inboard of a block's columns, or of them
  AlignedVector<T> unit;           // rows of the identity

  template <class S>
  explicit DerivativeColumns(const StructuredModel<S>& model)
      : rows(model.nv()),
        inward(model.slots()),
        outward(model.slots()),
        carries((model.nv() + lanes - 1) / lanes * model.nv()),
        unit(lanes * lanes, T(0)) {
    for (int i = 0; i < lanes; ++i) unit[i * lanes + i] = T(1);
    for (int j = 0; j < model.nv(); ++j)
      for (int k = j; k >= 0; k = model.link(k).parent) carries[j / lanes * model.nv() + k] = true;
  }
};

namespace detail {

template <class W>
[[gnu::always_inline]] inline Sixfold<W> nothing() {
  const W zero = W(0);
  return {zero, zero, zero, zero, zero, zero};
}

// y += unit x, unit being a row of the identity and x six numbers of the block's joints.
template <class T>
[[gnu::always_inline]] inline void add_own(const Wide<T>& unit, const DerivativeTerms<T>& terms,
                                           int number, int block, Sixfold<Wide<T>>& y) {
  const auto& table = terms.table;
  y.x += unit * table.load(number, block);
  y.y += unit * table.load(number + 1, block);
  y.z += unit * table.load(number + 2, block);
  y.u += unit * table.load(number + 3, block);
  y.v += unit * table.load(number + 4, block);
  y.w += unit * table.load(number + 5, block);
}

// z+ from z-, and e.
template <bool slides, class T>
[[gnu::always_inline]] inline Wide<T> measure(const DerivativeJoint<T>& at, Wide<T> e,
                                              Sixfold<Wide<T>>& z) {
  using W = Wide<T>;
  e -= along<slides>(at.s, z);
  z.x += W(at.g.x) * e;
  z.y += W(at.g.y) * e;
  z.z += W(at.g.z) * e;
  z.u += W(at.g.u) * e;
  z.v += W(at.g.v) * e;
  z.w += W(at.g.w) * e;
  return e;
}

template <class T, class S>
void sweep_inward(const StructuredModel<S>& model, const DerivativeTerms<T>& terms, int block,
                  DerivativeColumns<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using W = Wide<T>;
  constexpr int lanes = lanes_of<T>;
  const int first = block * lanes, end = std::min(first + lanes, model.nv());
  const W zero = W(0);
  for (auto& z : ws.inward) z.m = z.q = z.v = nothing<W>();
  Sixfold<W> m, q, v;
  bool carried = false;
  for (int k = end - 1; k >= 0; --k) {
    const StructuredLink<S>& link = model.link(k);
    auto& row = ws.rows[k];
    if (!ws.carries[block * model.nv() + k]) {
      row.m = row.q = row.v = zero;
      carried = false;
      continue;
    }
    if (!carried) m = q = v = nothing<W>();
    if (link.slot >= 0) {
      add(m, ws.inward[link.slot].m);
      add(q, ws.inward[link.slot].q);
      add(v, ws.inward[link.slot].v);
    }
    const DerivativeJoint<T>& at = terms.joints[k];
    W own = zero;
    if (k >= first) {
      own = load(&ws.unit[(k - first) * lanes]);
      add_own(own, terms, Terms::x_q, block, q);
      add_own(own, terms, Terms::x_qd, block, v);
    }
    if (link.slides) {
      row.m = measure<true>(at, own, m);
      row.q = measure<true>(at, zero, q);
      row.v = measure<true>(at, zero, v);
    } else {
      row.m = measure<false>(at, own, m);
      row.q = measure<false>(at, zero, q);
      row.v = measure<false>(at, zero, v);
    }
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    if (link.coordinate == Coordinate::quaternion)
      for (int j = std::max(k, first); j < std::min(k + 3, end); ++j)
        add_own(load(&ws.unit[(j - first) * lanes]), terms, Terms::H_x_F, block, q);
    if (link.kind != StructuredLink<S>::Kind::cyclic) {
      move_inward(at.r, m);
      move_inward(at.r, q);
      move_inward(at.r, v);
    }
    if (carried) continue;
    auto& branch = ws.inward[model.link(link.parent).slot];
    add(branch.m, m);
    add(branch.q, q);
    add(branch.v, v);
  }
  for (int k = end; k < model.nv(); ++k) ws.rows[k].q = ws.rows[k].v = zero;
}

// y and l- from l+ and e.
template <bool slides, class T>
[[gnu::always_inline]] inline void respond(const DerivativeJoint<T>& at, const Wide<T>& qb,
                                           Wide<T>& row, Sixfold<Wide<T>>& l) {
  using W = Wide<T>;
  const W angular = W(at.g.x) * l.x + W(at.g.y) * l.y + W(at.g.z) * l.z;
  const W linear = W(at.g.u) * l.u + W(at.g.v) * l.v + W(at.g.w) * l.w;
  row = (row * W(at.inverse_D) - qb - angular) - linear;
  add_along<slides>(at.s, row, l);
}

// Links from `begin` on; M^-1 needs those inboard of the block's last column alone.
template <bool inverse, class T, class S>
void sweep_outward(const StructuredModel<S>& model, const DerivativeTerms<T>& terms, int block,
                   int begin, int end, typename DerivativeColumns<T>::Outward& l,
                   DerivativeColumns<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using W = Wide<T>;
  constexpr int lanes = lanes_of<T>;
  const int first = block * lanes;
  const W zero = W(0);
  Sixfold<W> m = l.m, q = l.q, v = l.v;
  Triple<W> b_q = l.b_q, b_v = l.b_v;
  for (int k = begin; k < end; ++k) {
    const StructuredLink<S>& link = model.link(k);
    const DerivativeJoint<T>& at = terms.joints[k];
    if (link.parent < 0) {
      m = q = v = nothing<W>();
      b_q = b_v = {zero, zero, zero};
    } else {
      if (!link.hangs_on_previous) {
        const auto& branch = ws.outward[model.link(link.parent).slot];
        if constexpr (inverse) m = branch.m;
        q = branch.q;
        v = branch.v;
        b_q = branch.b_q;
        b_v = branch.b_v;
      }
      if (link.kind != StructuredLink<S>::Kind::cyclic) {
        if constexpr (inverse) move_outward(at.r, m);
        move_outward(at.r, q);
        move_outward(at.r, v);
      }
    }
    auto& row = ws.rows[k];
    const Triple<W> turned = {W(at.q.x), W(at.q.y), W(at.q.z)};
    if (link.slides) {
      if constexpr (inverse) respond<true>(at, zero, row.m, m);
      respond<true>(at, dot(turned, b_q), row.q, q);
      respond<true>(at, dot(turned, b_v), row.v, v);
    } else {
      if constexpr (inverse) respond<false>(at, zero, row.m, m);
      respond<false>(at, dot(turned, b_q), row.q, q);
      respond<false>(at, dot(turned, b_v), row.v, v);
    }
    if (k >= first && k < first + lanes) {
      const W own = load(&ws.unit[(k - first) * lanes]);
      add_own(own, terms, Terms::chi, block, q);
      add_own(own, terms, Terms::chi_qd, block, v);
      b_q = b_q + own * terms.table.load3(Terms::psi, block);
      b_v = b_v + own * terms.table.load3(Terms::turn, block);
    }
    if (link.slot >= 0) {
      auto& branch = ws.outward[link.slot];
      if constexpr (inverse) branch.m = m;
      branch.q = q;
      branch.v = v;
      branch.b_q = b_q;
      branch.b_v = b_v;
    }
  }
  if constexpr (inverse) {
    l.q = q;
    l.v = v;
    l.b_q = b_q;
    l.b_v = b_v;
  }
}

// The first `count` lanes.
template <class T>
[[gnu::always_inline]] inline void store_some(const Wide<T>& x, int count, T* to) {
  if (count == lanes_of<T>) return store(x, to);
  std::array<T, lanes_of<T>> numbers;
  store(x, numbers.data());
  for (int i = 0; i < count; ++i) to[i] = numbers[i];
}

// Rows of columns to columns of rows, for a tile.
template <class T>
[[gnu::always_inline]] inline void turn_tile(Wide<T>* tile) {
  if constexpr ((lanes_of<T>) > 1) transpose(tile);
}

// Every row of a block's columns of da/dq or da/dq'.
template <class T>
void write_columns(const DerivativeColumns<T>& ws, Wide<T> DerivativeColumns<T>::Row::*part,
                   int block, int nv, T* out) {
  constexpr int lanes = lanes_of<T>;
  const int first = block * lanes, columns = std::min(lanes, nv - first);
  for (int row = 0; row < nv; row += lanes) {
    const int start = std::max(0, std::min(row, nv - lanes)), height = std::min(lanes, nv);
    Wide<T> tile[lanes];
    for (int i = 0; i < lanes; ++i) tile[i] = ws.rows[std::min(start + i, nv - 1)].*part;
    turn_tile<T>(tile);
    for (int j = 0; j < columns; ++j) store_some(tile[j], height, out + (first + j) * nv + start);
  }
}

// A block's columns of M^-1 down to the diagonal, and their mirror image.
template <class T>
void write_inverse(const DerivativeColumns<T>& ws, int block, int nv, T* out) {
  constexpr int lanes = lanes_of<T>;
  const int first = block * lanes, columns = std::min(lanes, nv - first);
  Wide<T> tile[lanes];
  for (int row = 0; row < first; row += lanes) {
    for (int i = 0; i < lanes; ++i) {
      tile[i] = ws.rows[row + i].m;
      store_some(tile[i], columns, out + (row + i) * nv + first);
    }
    turn_tile<T>(tile);
    for (int j = 0; j < columns; ++j) store(tile[j], out + (first + j) * nv + row);
  }
  for (int i = 0; i < columns; ++i) {
    std::array<T, lanes> numbers;
    store(ws.rows[first + i].m, numbers.data());
    for (int j = i; j < columns; ++j)
      out[(first + i) * nv + first + j] = out[(first + j) * nv + first + i] = numbers[j];
  }
}

}  // namespace detail

// da_dq, da_dqd and da_dtau (nv x nv, by columns) after derivative_terms.
template <class T, class S>
void derivative_columns(const StructuredModel<S>& model, const DerivativeTerms<T>& terms,
                        DerivativeColumns<T>& ws, T* da_dq, T* da_dqd, T* da_dtau) {
  using Row = typename DerivativeColumns<T>::Row;
  const int nv = model.nv();
  for (int block = 0; block < terms.table.blocks(); ++block) {
    const int end = std::min((block + 1) * lanes_of<T>, nv);
    typename DerivativeColumns<T>::Outward l;
    detail::sweep_inward(model, terms, block, ws);
    detail::sweep_outward<true>(model, terms, block, 0, end, l, ws);
    detail::sweep_outward<false>(model, terms, block, end, nv, l, ws);
    detail::write_inverse(ws, block, nv, da_dtau);
    detail::write_columns(ws, &Row::q, block, nv, da_dq);
    detail::write_columns(ws, &Row::v, block, nv, da_dqd);
  }
}

}  // namespace kalmarm
