// Steps (4) to (6) of square_root.hpp: the rows of P+ are moved to the parent's frame and absorbed
// into the parent's rows.
//
//   (4) alpha, beta, z <- phi of them                                                       (4.4)
//   (5) l1, l2, l3 of the parent are the pivots against the linear rows, which lose vx, vy, vz and
//       become rotational
//   (6) rz, rx of the parent are the pivots against the rotational rows; ry takes what is left:
//         j2 = Dy + sum w y^2,  oy = (Dy zeta_y + sum w y zeta) / j2
// The parent's rows are its body's (factored_body.hpp), or those accumulated from other children.
//
// p+ = p + g r+ of a step is not enough where the pivot's weight d is small beside the row's, w: a
// row whose entry is a rounding error makes the others of p as large as sqrt(w / d) / 2, and the
// next row takes that off again, but for u sqrt(w / d). Where the parent's body is that light
// (FactoredBody::is_light_beside), has no weight, or holds other children's rows, the steps are the
// stable ones, p+ = f p + g r.
#pragma once

#include <type_traits>

#include "algorithms/spatial/inlining.hpp"
#include "algorithms/study/square_root/square_root_measure.hpp"

namespace kalmarm {

namespace detail {

// (4) of an aligned hinge.
template <class T, class S, class C, class R>
KALMARM_INLINE auto to_parent(const LoweredLink<S>& link, const Direction<C>& joint, const R& row) {
  const T d = T(link.d), c = T(link.alpha.c), s = T(link.alpha.s);
  const auto x0 = row.x - d * row.v;
  const auto y0 = row.y + d * row.u;
  const T x = joint.c * x0 - joint.s * y0, y1 = joint.s * x0 + joint.c * y0;
  const auto u = joint.c * row.u - joint.s * row.v;
  const auto v1 = joint.s * row.u + joint.c * row.v;
  const T y2 = c * y1 - s * row.z, z2 = s * y1 + c * row.z;
  const auto v = c * v1 - s * row.w;
  const auto w = s * v1 + c * row.w;
  const T a = T(link.p[0]);
  auto out = make_row(x, T(y2 - a * w), T(z2 + a * v), u, v, w, row.zeta, row.weight);
  if (link.p[1] != S(0)) {
    out.z = out.z - T(link.p[1]) * u;
    out.x = out.x + T(link.p[1]) * w;
  }
  return out;
}

template <class T, class S>
KALMARM_INLINE void start(const SquareRootModel<S>& model, int k, const CovarianceWorkspace<T>& ws,
                          SquareRoot<T>& at) {
  const auto& link = ws.links[k];
  const T zero = T(S(0));
  widen(body_rows(model.factored(k), link.wx, link.wy, link.wz), at.P);
  at.z = {zero, zero, zero, zero, zero, zero};
  at.reach = T(model.factored(k).distance);
}

// A row in the frame of the parent of a follower.
template <class T, class X, class Y, class Z, class U, class V, class W>
KALMARM_INLINE auto cycle(const Row<T, X, Y, Z, U, V, W>& r) {
  return make_row<T>(r.z, r.x, r.y, r.w, r.u, r.v, r.zeta, r.weight);
}

// (5) and (6) of a follower to a parent without a body: its rows are the pivots, and the column
// that was eliminated gets a row of least weight.
template <bool slides, class S, class T, class Rows>
KALMARM_INLINE void cycle_rows(const Rows& rows, FullTriangle<T>& P) {
  const T zero = T(S(0)), least = T(least_weight<S>());
  if constexpr (slides) {
    const auto z = eliminate<Column::z, true>(cycle(rows.ry), cycle(rows.rx), cycle(rows.rz));
    P.l1 = {zero, zero, zero, {}, zero, zero, zero, least};
    widen(cycle(rows.l1), P.l2);
    widen(cycle(rows.l2), P.l3);
    widen(z.pivot, P.rz);
    widen(z.b, P.rx);
    P.ry = {z.a.weight, z.a.weight * z.a.zeta};
  } else {
    const auto u = eliminate<Column::u, true>(cycle(rows.l3), cycle(rows.l2), cycle(rows.l1));
    const auto z = eliminate<Column::z, true>(cycle(rows.ry), cycle(rows.rx));
    widen(u.pivot, P.l1);
    widen(u.b, P.l2);
    widen(u.a, P.l3);
    widen(z.pivot, P.rz);
    P.rx = {{}, zero, {}, {}, {}, {}, zero, least};
    P.ry = {z.a.weight, z.a.weight * z.a.zeta};
  }
}

// A bound of the distance from the parent's origin to the link's.
template <class T, class S>
T distance_to_parent(const SquareRootModel<S>& model, int k, const CovarianceWorkspace<T>& ws) {
  const LoweredLink<S>& link = model.link(k);
  const auto size = [](const T& x) { return larger(x, T(-x)); };
  if (link.coordinate == Coordinate::position) {
    const auto& p = ws.matrices[link.varying].p;
    return size(p[0]) + size(p[1]) + size(p[2]);
  }
  const T length = T(model.factored(k).length);
  return link.coordinate == Coordinate::distance ? T(length + size(ws.links[k].d)) : length;
}

// (4), (5), (6) to a parent that may hold the rows of other children.
template <class T, class S, class Rows>
KALMARM_INLINE void give_to_parent(const SquareRootModel<S>& model, int k,
                                   SquareRootWorkspace<T>& ws, const Rows& rows,
                                   SquareRoot<T>& at) {
  using Kind = typename LoweredLink<S>::Kind;
  const LoweredLink<S>& link = model.link(k);
  const int index = model.link(link.parent).branch;
  SquareRoot<T> to;
  if (index >= 0 && ws.sums[index].begun)
    to = ws.sums[index];
  else
    start(model, link.parent, ws, to);
  const auto move = [&](Sixfold<T>& x) KALMARM_INLINE_LAMBDA {
    if (link.kind == Kind::matrix)
      force_to_parent(ws.matrices[link.varying], x);
    else if (link.kind == Kind::cyclic)
      x = cycle(x);
    else if (link.slides)
      force_to_parent(model, link, model.uncommon(link).turn, ws.links[k].d, x);
    else
      force_to_parent(model, link, Direction<T>{ws.cos[link.varying], ws.sin[link.varying]}, link.d,
                      x);
  };
  const auto moved = [&](const auto& known) KALMARM_INLINE_LAMBDA {
    if constexpr (std::is_same_v<std::decay_t<decltype(known)>, None>) {
      return None{};
    } else {
      Row<T> row;
      widen(known, row);
      Sixfold<T> x = {row.x, row.y, row.z, row.u, row.v, row.w};
      move(x);
      return Row<T>{x.x, x.y, x.z, x.u, x.v, x.w, row.zeta, row.weight};
    }
  };
  const auto moved_spin = [&](const auto& known) KALMARM_INLINE_LAMBDA {
    const auto row = moved(known);
    if constexpr (std::is_same_v<std::decay_t<decltype(row)>, None>)
      return None{};
    else
      return Spin<T>{row.x, row.y, row.z, {}, {}, {}, row.zeta, row.weight};
  };
  widen(absorb<true>(to.P, moved_spin(rows.rx), moved_spin(rows.ry), moved_spin(rows.rz),
                     moved(rows.l1), moved(rows.l2), moved(rows.l3)),
        to.P);
  move(at.z);
  add(to.z, at.z);
  to.reach = larger(to.reach, T(at.reach + distance_to_parent(model, k, ws)));
  at = to;
}

}  // namespace detail

}  // namespace kalmarm
