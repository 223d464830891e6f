// Columns of M^-1, da/dq and da/dq', a register's width of columns at once: lane j of every number
// is that of column j.
//
// A unit torque, or the x of (B3), goes inward through the filter and comes back outward as an
// acceleration l; outboard of j turns what a turn of everything there turns with it, b:
//   inward   z- = sum of phi z+, and x(j) at k = j
//            e = (1 at k = j) - H z-  for M^-1,  -H z-  for the others;   z+ = z- + g e   (4.2),
//            (4.5)
//   outward  l+ = phi' l-,  y(k) = e / D - g'l+ - q'b,  l- = l+ + H'y                     (4.9),
//   (4.11)
//            and at k = j: l- += chi, b = psi_w for dq;  l- += (v- + v+) x H, b = H_w for dq'
// y is the column. Lanes that have not begun hold zeros, so branches need no masks: what a branch
// adds is saved where the tree branches. 15 numbers in and 16 to 19 out a link and register.
#pragma once

#include <array>
#include <vector>

#include "algorithms/structured/derivative_filter.hpp"

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

  AlignedVector<Row> rows;                                       // e, then y, of every link
  std::vector<Inward, Eigen::aligned_allocator<Inward>> inward;  // of links with branches
  std::vector<Outward, Eigen::aligned_allocator<Outward>> outward;
  std::vector<bool> carries;  // link k is inboard of a block's columns, or of them
  AlignedVector<T> unit;      // rows of the identity

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

// From link end - 1 to link `begin`, with z- from outboard in and what goes to the parent out. With
// `own`, columns of the block begin on the way.
template <bool own, class T, class S>
void sweep_inward(const StructuredModel<S>& model, const DerivativeTerms<T>& terms, int block,
                  int begin, int end, DerivativeColumns<T>& ws,
                  typename DerivativeColumns<T>::Inward& z) {
  using Terms = DerivativeTerms<T>;
  using W = Wide<T>;
  constexpr int lanes = lanes_of<T>;
  const int first = block * lanes;
  const W zero = W(0);
  Sixfold<W> m = z.m, q = z.q, v = z.v;
  bool carried = true;
  for (int k = end - 1; k >= begin; --k) {
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
    W torque = zero;
    if (own && k >= first) {
      torque = load(&ws.unit[(k - first) * lanes]);
      add_own(torque, terms, Terms::x_q, block, q);
      add_own(torque, terms, Terms::x_qd, block, v);
    }
    if (link.slides) {
      row.m = measure<true>(at, torque, m);
      row.q = measure<true>(at, zero, q);
      row.v = measure<true>(at, zero, v);
    } else {
      row.m = measure<false>(at, torque, m);
      row.q = measure<false>(at, zero, q);
      row.v = measure<false>(at, zero, v);
    }
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    if (own && link.coordinate == Coordinate::quaternion)
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
  z.m = m;
  z.q = q;
  z.v = v;
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

// From link `begin` to link end - 1, with l- of the parent in and of the last link out; without
// M^-1 where `inverse` is false.
template <bool own, bool inverse, class T, class S>
void sweep_outward(const StructuredModel<S>& model, const DerivativeTerms<T>& terms, int block,
                   int begin, int end, DerivativeColumns<T>& ws,
                   typename DerivativeColumns<T>::Outward& l) {
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
    if (own && k >= first && k < first + lanes) {
      const W unit = load(&ws.unit[(k - first) * lanes]);
      add_own(unit, terms, Terms::chi, block, q);
      add_own(unit, terms, Terms::chi_qd, block, v);
      b_q = b_q + unit * terms.table.load3(Terms::psi, block);
      b_v = b_v + unit * terms.table.load3(Terms::turn, block);
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
  if constexpr (inverse) l.m = m;
  l.q = q;
  l.v = v;
  l.b_q = b_q;
  l.b_v = b_v;
}

// Rows of columns to columns of rows, for a tile.
template <class T>
[[gnu::always_inline]] inline void turn_tile(Wide<T>* tile) {
  if constexpr ((lanes_of<T>) > 1) transpose(tile);
}

// Links `begin` to end - 1 of a block's columns. The last tile of rows ends with them where there
// are enough.
template <class T>
void write_columns(const DerivativeColumns<T>& ws, Wide<T> DerivativeColumns<T>::Row::*part,
                   int block, int begin, int end, int nv, T* out) {
  constexpr int lanes = lanes_of<T>;
  const int first = block * lanes, columns = std::min(lanes, nv - first);
  for (int row = begin; row < end; row += lanes) {
    const int start = std::max(begin, std::min(row, end - lanes));
    Wide<T> tile[lanes];
    for (int i = 0; i < lanes; ++i) tile[i] = ws.rows[std::min(start + i, end - 1)].*part;
    turn_tile<T>(tile);
    for (int j = 0; j < columns; ++j) {
      const int at = (first + j) * nv + start;
      store_some(tile[j], end - start, at + lanes <= nv * nv, out + at);
    }
  }
}

// The block of M^-1 on the diagonal: what is above it, and its mirror image.
template <class T>
void write_diagonal(const DerivativeColumns<T>& ws, int block, int nv, T* out) {
  constexpr int lanes = lanes_of<T>;
  const int first = block * lanes, columns = std::min(lanes, nv - first);
  Wide<T> tile[lanes], mirror[lanes];
  for (int i = 0; i < lanes; ++i) tile[i] = mirror[i] = ws.rows[std::min(first + i, nv - 1)].m;
  turn_tile<T>(mirror);
  for (int i = 0; i < columns; ++i) {
    const int at = (first + i) * nv + first;
    const bool room = at + lanes <= nv * nv;
    store_some(tile[i], columns, room, out + at);
    store_some(mirror[i], std::min(i, columns), room, out + at);
  }
}

// What is above the diagonal of M^-1 in columns `begin` to end - 1 is copied below it.
template <class T>
void mirror(int begin, int end, int nv, T* out) {
  constexpr int lanes = lanes_of<T>;
  for (int row = 0; row < end; row += lanes)
    for (int first = std::max(begin, row + lanes); first < end; first += lanes) {
      const int columns = std::min(lanes, end - first);
      Wide<T> tile[lanes];
      for (int j = 0; j < lanes; ++j)
        tile[j] = load(out + (first + std::min(j, columns - 1)) * nv + row);
      turn_tile<T>(tile);
      for (int i = 0; i < lanes; ++i)
        store_some(tile[i], columns, true, out + (row + i) * nv + first);
    }
}

// A block's columns of any tree.
template <class T, class S>
void tree_columns(const StructuredModel<S>& model, const DerivativeTerms<T>& terms, int block,
                  DerivativeColumns<T>& ws, T* da_dq, T* da_dqd, T* da_dtau) {
  using W = Wide<T>;
  using Row = typename DerivativeColumns<T>::Row;
  constexpr int lanes = lanes_of<T>;
  const int nv = model.nv(), first = block * lanes, end = std::min(first + lanes, nv);
  const W zero = W(0);
  typename DerivativeColumns<T>::Inward z;
  typename DerivativeColumns<T>::Outward l;
  z.m = z.q = z.v = nothing<W>();
  for (auto& branch : ws.inward) branch = z;
  sweep_inward<true>(model, terms, block, 0, end, ws, z);
  for (int k = end; k < nv; ++k) ws.rows[k].q = ws.rows[k].v = zero;
  sweep_outward<true, true>(model, terms, block, 0, end, ws, l);
  sweep_outward<true, false>(model, terms, block, end, nv, ws, l);
  write_diagonal(ws, block, nv, da_dtau);
  if (first > 0) write_columns(ws, &Row::m, block, 0, first, nv, da_dtau);
  write_columns(ws, &Row::q, block, 0, nv, nv, da_dq);
  write_columns(ws, &Row::v, block, 0, nv, nv, da_dqd);
}

}  // namespace detail

}  // namespace kalmarm
