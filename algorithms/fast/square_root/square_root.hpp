// Forward dynamics by a square-root form of the articulated body algorithm, on the lowering and
// with the smoother of the conventional one (forward_dynamics.hpp).
//
// The articulated inertia P and the bias are weighted rows: Gauss' principle, the accelerations
// minimise
//   sum over rows of w (alpha'w' + beta'v' + zeta)^2  less what the torques do.
//   P = sum of w row'row,   force = sum of w row' zeta + z
// z holds what comes of the joint torques alone, so no force that is large because a mass is large
// is ever formed. Rows of link k, triangular in the order of columns vx, vy, vz, z, x, y:
//   l1 (x,y,z; 1,u12,u13), l2 (x,y,z; 0,1,u23), l3 (x,y,z; 0,0,1)               d1, d2, d3
//   rz (z:1, x:gx, y:gy), rx (x:1, y:l), ry (y:1)                               dz, j1, j2
// Tips to base, at a hinge:
//   (1) rz is the pivot of stable fast Givens steps in column z against l3, l2, l1. Then
//         rz = (gx,gy,1; hx,hy,hz | b),  D = dz,  g = rz                         (3.6), (3.10)
//       and no other row has an entry z. rz is deleted: HP+ = 0.
//   (2) e = tau - z_z,  e+ = e / D - b                                           (4.2), (4.6)
//       z += g e,  z_z = tau                                                     (4.5)
//   (3) zeta += alpha'c + beta'c                                                 P+ c of (4.5)
//   (4) alpha, beta, z <- phi of them                                            (4.4)
//   (5) l1, l2, l3 of the parent, at first its body's (factored_body.hpp), are the pivots against
//       the linear rows, which lose vx, vy, vz and become rotational
//   (6) rz, rx of the parent are the pivots against the rotational rows; ry takes what is left:
//         j2 = Dy + sum w y^2,  oy = (Dy zeta_y + sum w y zeta) / j2
// At a slide
//   (1') l3 is the pivot in column vz against l2, l1; then D = d3, g = l3 = (x,y,z; hx,hy,1 | b)
// Joint noise r is a row of its own, r (q'')^2, which is the pivot in a column for q'' whose
// entries are those of column z (of vz at a slide), against rz, l3, l2, l1. It becomes g, b and D,
// and so
//   (1") g_z = d / D, D = r + d, d = dz + sum w z^2;  row i keeps z r / D(i-1), D before its step
// so that beta stays triangular and rz without beta.
// Another child's rows go into what the first has left in (5) and (6). Links without a body are
// bodies of least weight, but a follower's rows are cycled and become its parent's, and a joint
// with nothing between its axes is crossed at once.
// About 790 flops a hinge that is an heir.
#pragma once

#include "algorithms/riccati/array.hpp"
#include "algorithms/structured/factors.hpp"
#include "algorithms/structured/square_root_measure.hpp"

namespace kalmarm {

namespace detail {

// (4) of an heir.
template <class T, class S, class C, class R>
[[gnu::always_inline]] inline auto to_parent(const StructuredLink<S>& link,
                                             const Direction<C>& joint, const R& row) {
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
[[gnu::always_inline]] inline void start(const StructuredModel<S>& model, int k,
                                         const StructuredWorkspace<T>& ws, SquareRoot<T>& at) {
  const auto& link = ws.links[k];
  const T zero = T(S(0));
  widen(body_rows(model.factored(k), link.wx, link.wy, link.wz), at.P);
  at.z = {zero, zero, zero, zero, zero, zero};
  at.reach = T(model.factored(k).distance);
}

// Across the hinge of an heir, to a parent without other children so far.
template <bool noise, class T, class S>
[[gnu::always_inline]] inline void cross_heir(const StructuredModel<S>& model, int k, const T& tau,
                                              SquareRootWorkspace<T>& ws, SquareRoot<T>& at) {
  const StructuredLink<S>& link = model.link(k);
  auto rows = measure_turn<noise>(at.P, T(model.body(k).r));
  measure<noise, false>(model, k, tau, ws, at, rows);
  const Direction<T> joint{ws.cos[link.varying], ws.sin[link.varying]};
  const auto& parent = ws.links[link.parent];
  const auto body = body_rows(model.factored(link.parent), parent.wx, parent.wy, parent.wz);
  const auto moved = [&](const auto& row) __attribute__((always_inline)) {
    if constexpr (std::is_same_v<std::decay_t<decltype(row)>, None>)
      return None{};
    else
      return to_parent<T>(link, joint, row);
  };
  widen(absorb(body, moved(rows.rx), moved(rows.ry), moved(rows.rz), moved(rows.l1), moved(rows.l2),
               moved(rows.l3)),
        at.P);
  force_to_parent(model, link, joint, link.d, at.z);
  at.reach =
      larger(T(model.factored(link.parent).distance), T(at.reach + model.factored(k).length));
}

// A row in the frame of the parent of a follower.
template <class T, class X, class Y, class Z, class U, class V, class W>
[[gnu::always_inline]] inline auto cycle(const Row<T, X, Y, Z, U, V, W>& r) {
  return make_row<T>(r.z, r.x, r.y, r.w, r.u, r.v, r.zeta, r.weight);
}

// (5) and (6) of a follower to a parent without a body: its rows are pivots themselves, and the
// column in which none is left has a row of least weight.
template <bool slides, class S, class T, class Rows>
[[gnu::always_inline]] inline void cycle_rows(const Rows& rows, FullTriangle<T>& P) {
  const T zero = T(S(0)), least = T(least_weight<S>());
  if constexpr (slides) {
    const auto z = eliminate<Column::z>(cycle(rows.ry), cycle(rows.rx), cycle(rows.rz));
    P.l1 = {zero, zero, zero, {}, zero, zero, zero, least};
    widen(cycle(rows.l1), P.l2);
    widen(cycle(rows.l2), P.l3);
    widen(z.pivot, P.rz);
    widen(z.b, P.rx);
    P.ry = {z.a.weight, z.a.weight * z.a.zeta};
  } else {
    const auto u = eliminate<Column::u>(cycle(rows.l3), cycle(rows.l2), cycle(rows.l1));
    const auto z = eliminate<Column::z>(cycle(rows.ry), cycle(rows.rx));
    widen(u.pivot, P.l1);
    widen(u.b, P.l2);
    widen(u.a, P.l3);
    widen(z.pivot, P.rz);
    P.rx = {{}, zero, {}, {}, {}, {}, zero, least};
    P.ry = {z.a.weight, z.a.weight * z.a.zeta};
  }
}

// A bound of how far the origin is from the parent's.
template <class T, class S>
T distance_to_parent(const StructuredModel<S>& model, int k, const StructuredWorkspace<T>& ws) {
  const StructuredLink<S>& link = model.link(k);
  const auto size = [](const T& x) { return larger(x, T(-x)); };
  if (link.coordinate == Coordinate::position) {
    const auto& p = ws.matrices[link.varying].p;
    return size(p[0]) + size(p[1]) + size(p[2]);
  }
  const T length = T(model.factored(k).length);
  return link.coordinate == Coordinate::distance ? T(length + size(ws.links[k].d)) : length;
}

// (4), (5), (6) to a parent that may have summed up other children.
template <class T, class S, class Rows>
[[gnu::always_inline]] inline void give_to_parent(const StructuredModel<S>& model, int k,
                                                  SquareRootWorkspace<T>& ws, const Rows& rows,
                                                  SquareRoot<T>& at) {
  using Kind = typename StructuredLink<S>::Kind;
  const StructuredLink<S>& link = model.link(k);
  const int slot = model.link(link.parent).slot;
  SquareRoot<T> to;
  if (slot >= 0 && ws.sums[slot].begun)
    to = ws.sums[slot];
  else
    start(model, link.parent, ws, to);
  const auto move = [&](Sixfold<T> & x) __attribute__((always_inline)) {
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
  const auto moved = [&](const auto& known) __attribute__((always_inline)) {
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
  const auto moved_spin = [&](const auto& known) __attribute__((always_inline)) {
    const auto row = moved(known);
    if constexpr (std::is_same_v<std::decay_t<decltype(row)>, None>)
      return None{};
    else
      return Spin<T>{row.x, row.y, row.z, {}, {}, {}, row.zeta, row.weight};
  };
  widen(absorb(to.P, moved_spin(rows.rx), moved_spin(rows.ry), moved_spin(rows.rz), moved(rows.l1),
               moved(rows.l2), moved(rows.l3)),
        to.P);
  move(at.z);
  add(to.z, at.z);
  to.reach = larger(to.reach, T(at.reach + distance_to_parent(model, k, ws)));
  at = to;
}

// Across any joint.
template <bool slides, bool noise, class T, class S>
[[gnu::noinline, gnu::optimize("no-tree-slp-vectorize")]] void cross_any(
    const StructuredModel<S>& model, int k, const T& tau, SquareRootWorkspace<T>& ws,
    SquareRoot<T>& at) {
  using Kind = typename StructuredLink<S>::Kind;
  const StructuredLink<S>& link = model.link(k);
  auto rows = [&] {
    if constexpr (slides)
      return measure_slide<noise>(at.P, T(model.body(k).r));
    else
      return measure_turn<noise>(at.P, T(model.body(k).r));
  }();
  measure<noise, slides>(model, k, tau, ws, at, rows);
  if (link.parent < 0) return;
  if constexpr (!noise) {
    const int slot = model.link(link.parent).slot;
    const bool others = slot >= 0 && ws.sums[slot].begun;
    if (link.kind == Kind::cyclic && model.link(link.parent).massless && !others) {
      cycle_rows<slides, S>(rows, at.P);
      at.z = cycle(at.z);
      return;
    }
  }
  give_to_parent(model, k, ws, rows, at);
}

// The slides of a free joint, whose last DoF is k, by (1') one after another: rows a, b, c of any
// beta are what P is, and pivots of least weight take them in.
template <class T, class S, class A, class B, class C>
[[gnu::always_inline]] inline void cross_slides(const StructuredModel<S>& model, int k,
                                                const T* tau, SquareRootWorkspace<T>& ws,
                                                SquareRoot<T>& at, const A& a, const B& b,
                                                const C& c) {
  const Zero o;
  const One one;
  const T zero = T(S(0)), least = T(least_weight<S>());
  const auto w = eliminate<Column::w, true>(make_row<T>(o, o, o, o, o, one, zero, least), a, b, c);
  keep<false, true>(model, k, tau[k], ws, at, w.pivot);
  at.z = cycle(at.z);
  const auto v =
      eliminate<Column::v, true>(make_row<T>(o, o, o, o, one, o, zero, least), w.a, w.b, w.c);
  keep<false, true>(model, k - 1, tau[k - 1], ws, at, cycle(v.pivot));
  at.z = cycle(at.z);
  const auto u =
      eliminate<Column::u, true>(make_row<T>(o, o, o, one, o, o, zero, least), v.a, v.b, v.c);
  keep<false, true>(model, k - 2, tau[k - 2], ws, at, cycle(cycle(u.pivot)));
}

// Across a joint at once (three_axes.hpp): of a ball joint the columns z, y and x are eliminated
// as in (1), each from the rows that the one before has left, and only l1, l2, l3 without alpha are
// left; of a free joint nothing.
template <class T, class S>
[[gnu::noinline, gnu::optimize("no-tree-slp-vectorize")]] void cross_at_once(
    const StructuredModel<S>& model, const LinkRun& run, const T* tau, SquareRootWorkspace<T>& ws,
    SquareRoot<T>& at) {
  const int k = run.last, ball = k - 2;
  const None none;
  const auto z = eliminate<Column::z, true>(at.P.rz, at.P.l3, at.P.l2, at.P.l1);
  const auto spins = eliminate<Column::y, true>(as_row(at.P.ry), at.P.rx);
  const auto y = eliminate<Column::y, true>(spins.pivot, z.a, z.b, z.c);
  const auto x = eliminate<Column::x, true>(spins.a, y.a, y.b, y.c);
  keep<false, false>(model, k, tau[k], ws, at, z.pivot);
  at.z = cycle(at.z);
  keep<false, false>(model, k - 1, tau[k - 1], ws, at, cycle(y.pivot));
  at.z = cycle(at.z);
  keep<false, false>(model, ball, tau[ball], ws, at, cycle(cycle(x.pivot)));
  auto l3 = cycle(cycle(x.a));
  auto l2 = cycle(cycle(x.b));
  auto l1 = cycle(cycle(x.c));
  const Sixfold<T>& c = ws.links[ball].c;
  add_acceleration(c, true, l1);
  add_acceleration(c, true, l2);
  add_acceleration(c, true, l3);
  const int parent = model.link(run.first).parent;
  if (run.first == ball) {
    if (parent >= 0)
      give_to_parent(model, ball, ws, Measured{none, l1, l2, l3, none, none, none}, at);
    return;
  }
  const auto& phi = ws.matrices[model.link(ball).varying];
  const auto turned = [&](const auto& row) __attribute__((always_inline)) {
    const auto& R = phi.R.R;
    const auto entry = [&](int i) __attribute__((always_inline)) {
      return T(R[i][0] * row.u + R[i][1] * row.v + R[i][2] * row.w);
    };
    const Zero o;
    return make_row<T>(o, o, o, entry(0), entry(1), entry(2), row.zeta, row.weight);
  };
  force_to_parent(phi, at.z);
  cross_slides(model, ball - 1, tau, ws, at, turned(l3), turned(l2), turned(l1));
  if (parent >= 0)
    give_to_parent(model, run.first, ws, Measured{none, none, none, none, none, none, none}, at);
}

// D, g, e+ of every link. Not in pairs: filter.hpp says why.
template <class T, class S>
[[gnu::optimize("no-tree-slp-vectorize")]] void filter(const StructuredModel<S>& model,
                                                       const T* tau, SquareRootWorkspace<T>& ws) {
  ws.margin = T(S(1));
  for (auto& sum : ws.sums) sum.begun = false;
  SquareRoot<T> at;
  bool carried = false;  // it comes from link k + 1
  const auto begin = [&](int k) __attribute__((always_inline)) {
    const int slot = model.link(k).slot;
    if (carried) return;
    if (slot >= 0 && ws.sums[slot].begun)
      at = ws.sums[slot];
    else
      start(model, k, ws, at);
  };
  const auto leave = [&](int k) __attribute__((always_inline)) {
    const int parent = model.link(k).parent;
    carried = model.link(k).hangs_on_previous;
    if (carried || parent < 0) return;
    auto& sum = ws.sums[model.link(parent).slot];
    static_cast<SquareRoot<T>&>(sum) = at;
    sum.begun = true;
  };
  for (auto run = model.runs().rbegin(); run != model.runs().rend(); ++run) {
    if (run->at_once) {
      begin(run->last);
      cross_at_once(model, *run, tau, ws, at);
      leave(run->first);
      continue;
    }
    for (int k = run->last; k >= run->first; --k) {
      const StructuredLink<S>& link = model.link(k);
      begin(k);
      const int slot = link.parent < 0 ? -1 : model.link(link.parent).slot;
      const bool heir = link.is_heir && !(slot >= 0 && ws.sums[slot].begun);
      if (heir && link.noise)
        cross_heir<true>(model, k, tau[k], ws, at);
      else if (heir)
        cross_heir<false>(model, k, tau[k], ws, at);
      else if (link.slides && link.noise)
        cross_any<true, true>(model, k, tau[k], ws, at);
      else if (link.slides)
        cross_any<true, false>(model, k, tau[k], ws, at);
      else if (link.noise)
        cross_any<false, true>(model, k, tau[k], ws, at);
      else
        cross_any<false, false>(model, k, tau[k], ws, at);
      leave(k);
    }
  }
}

}  // namespace detail

// a (nv) from q (nq), qd (nv) and tau (nv), all numbers in T; ws.margin and ws.check say whether it
// can be believed.
template <class T, class S>
void square_root_acceleration(const StructuredModel<S>& model, const T* q, const T* qd,
                              const T* tau, SquareRootWorkspace<T>& ws, T* a) {
  detail::set_placements(model, q, ws);
  detail::set_velocity(model, qd, ws);
  detail::filter(model, tau, ws);
  detail::smooth(model, ws, a);
}

// The factors at q (nq). ws has never seen a velocity: the bias is zero, and so is tau.
template <class S>
void square_root_factor(const StructuredModel<S>& model, const S* q, const std::vector<S>& zeros,
                        SquareRootWorkspace<S>& ws, StructuredFactors<S>& factors) {
  detail::set_placements(model, q, ws);
  detail::filter(model, zeros.data(), ws);
  static_cast<Placements<S>&>(factors) = ws;
  for (int k = 0; k < model.nv(); ++k)
    factors.links[k] = {ws.links[k].d, ws.inverse_D[k], ws.links[k].g};
  factors.margin = ws.margin;
}

}  // namespace kalmarm
