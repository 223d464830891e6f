// Columns of M^-1, da/dq and da/dq', one column per SIMD lane.
//
// Column j: the filter propagates a unit torque, or the force x of (B3), inward from joint j; the
// smoother propagates the acceleration l outward, and outboard of j also the turn b of everything
// there about joint j:
//   inward   z- = sum of phi z+, and x(j) at k = j
//            e = (1 at k = j) - H z-  for M^-1,  -H z-  for the others                        (4.2)
//            z+ = z- + g e                                                                    (4.5)
//   outward  l+ = phi' l-,  y(k) = e / D - g'l+ - q'b,  l- = l+ + H'y                 (4.9), (4.11)
//            and at k = j: l- += chi, b = psi_w for dq;  l- += (v- + v+) x H, b = H_w for dq'
// y is the column. On the way inward a lane is zero outboard of its joint j, so no masks are
// needed. Forces of children other than k + 1 are summed at their parent. 15 numbers are read and
// 16 to 19 written a link and register.
#pragma once

#include <array>
#include <vector>

#include "algorithms/fast/derivatives/derivative_filter.hpp"
#include "algorithms/spatial/inlining.hpp"

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
  explicit DerivativeColumns(const LoweredModel<S>& model)
      : rows(model.nv()),
        inward(model.branch_count()),
        outward(model.branch_count()),
        carries((model.nv() + lanes - 1) / lanes * model.nv()),
        unit(lanes * lanes, T(0)) {
    for (int i = 0; i < lanes; ++i) unit[i * lanes + i] = T(1);
    for (int j = 0; j < model.nv(); ++j)
      for (int k = j; k >= 0; k = model.link(k).parent) carries[j / lanes * model.nv() + k] = true;
  }
};

namespace detail {

template <class W>
KALMARM_INLINE Sixfold<W> nothing() {
  const W zero = W(0);
  return {zero, zero, zero, zero, zero, zero};
}

// y += unit x, unit being a row of the identity and x six numbers of the block's joints.
template <class T>
KALMARM_INLINE void add_own(Sixfold<Wide<T>>& y, const Wide<T>& unit,
                            const DerivativeTerms<T>& terms, int number, int block) {
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
KALMARM_INLINE Wide<T> measure(const DerivativeJoint<T>& at, Wide<T> e, Sixfold<Wide<T>>& z) {
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

// From link end - 1 to link `begin`: z- from outboard becomes the force on the parent of `begin`.
// `own`: the links are those of the block's own columns.
template <bool own, class T, class S>
void sweep_inward(const LoweredModel<S>& model, const DerivativeTerms<T>& terms, int block,
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
    const LoweredLink<S>& link = model.link(k);
    auto& row = ws.rows[k];
    if (!ws.carries[block * model.nv() + k]) {
      row.m = row.q = row.v = zero;
      carried = false;
      continue;
    }
    if (!carried) m = q = v = nothing<W>();
    if (link.branch >= 0) {
      add(m, ws.inward[link.branch].m);
      add(q, ws.inward[link.branch].q);
      add(v, ws.inward[link.branch].v);
    }
    const DerivativeJoint<T>& at = terms.joints[k];
    W torque = zero;
    if (own && k >= first) {
      torque = load(&ws.unit[(k - first) * lanes]);
      add_own(q, torque, terms, Terms::x_q, block);
      add_own(v, torque, terms, Terms::x_qd, block);
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
        add_own(q, load(&ws.unit[(j - first) * lanes]), terms, Terms::H_x_F, block);
    if (link.kind != LoweredLink<S>::Kind::cyclic) {
      move_inward(at.r, m);
      move_inward(at.r, q);
      move_inward(at.r, v);
    }
    if (carried) continue;
    auto& branch = ws.inward[model.link(link.parent).branch];
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
KALMARM_INLINE void respond(const DerivativeJoint<T>& at, const Wide<T>& qb, Wide<T>& row,
                            Sixfold<Wide<T>>& l) {
  using W = Wide<T>;
  const W angular = W(at.g.x) * l.x + W(at.g.y) * l.y + W(at.g.z) * l.z;
  const W linear = W(at.g.u) * l.u + W(at.g.v) * l.v + W(at.g.w) * l.w;
  row = (row * W(at.inverse_D) - qb - angular) - linear;
  add_along<slides>(l, at.s, row);
}

// From link `begin` to link end - 1: l- of the parent becomes l- of the last link. Without M^-1
// where `inverse` is false.
template <bool own, bool inverse, class T, class S>
void sweep_outward(const LoweredModel<S>& model, const DerivativeTerms<T>& terms, int block,
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
    const LoweredLink<S>& link = model.link(k);
    const DerivativeJoint<T>& at = terms.joints[k];
    if (link.parent < 0) {
      m = q = v = nothing<W>();
      b_q = b_v = {zero, zero, zero};
    } else {
      if (!link.hangs_on_previous) {
        const auto& branch = ws.outward[model.link(link.parent).branch];
        if constexpr (inverse) m = branch.m;
        q = branch.q;
        v = branch.v;
        b_q = branch.b_q;
        b_v = branch.b_v;
      }
      if (link.kind != LoweredLink<S>::Kind::cyclic) {
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
      add_own(q, unit, terms, Terms::chi, block);
      add_own(v, unit, terms, Terms::chi_qd, block);
      b_q = b_q + unit * terms.table.load3(Terms::psi, block);
      b_v = b_v + unit * terms.table.load3(Terms::turn, block);
    }
    if (link.branch >= 0) {
      auto& branch = ws.outward[link.branch];
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
KALMARM_INLINE void turn_tile(Wide<T>* tile) {
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

// The diagonal block of M^-1: its upper triangle, and the mirror image.
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

// Copies the upper triangle of M^-1 in columns `begin` to end - 1 to the lower one.
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
void tree_columns(const LoweredModel<S>& model, const DerivativeTerms<T>& terms, int block,
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
