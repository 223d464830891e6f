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
// Further children are absorbed by (5) and (6) into the rows accumulated so far. A link without a
// body counts as a body of least weight (factored_body.hpp), with two exceptions: the rows of a
// follower (lowered_model.hpp) are permuted and become its parent's, and a ball or free joint with
// nothing between its axes is one block step.
// About 837 flops an aligned hinge (lowered_model.hpp).
#pragma once

#include "algorithms/fast/factors/factors.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/study/square_root/square_root_parent.hpp"

namespace kalmarm {

namespace detail {

// Across an aligned hinge, to a parent that has no other child's rows yet.
template <bool noise, class T, class S>
KALMARM_INLINE void cross_aligned(const SquareRootModel<S>& model, int k, const T& tau,
                                  SquareRootWorkspace<T>& ws, SquareRoot<T>& at) {
  const LoweredLink<S>& link = model.link(k);
  auto rows = measure_turn<noise>(at.P, T(model.body(k).r));
  measure<noise, false>(model, k, tau, ws, at, rows);
  const Direction<T> joint{ws.cos[link.varying], ws.sin[link.varying]};
  const auto& parent = ws.links[link.parent];
  const auto body = body_rows(model.factored(link.parent), parent.wx, parent.wy, parent.wz);
  const auto moved = [&](const auto& row) KALMARM_INLINE_LAMBDA {
    if constexpr (std::is_same_v<std::decay_t<decltype(row)>, None>)
      return None{};
    else
      return to_parent<T>(link, joint, row);
  };
  widen(absorb<false>(body, moved(rows.rx), moved(rows.ry), moved(rows.rz), moved(rows.l1),
                      moved(rows.l2), moved(rows.l3)),
        at.P);
  force_to_parent(model, link, joint, link.d, at.z);
  at.reach =
      larger(T(model.factored(link.parent).distance), T(at.reach + model.factored(k).length));
}

// Across any joint.
template <bool slides, bool noise, class T, class S>
KALMARM_NOINLINE KALMARM_SWEEP void cross_any(const SquareRootModel<S>& model, int k, const T& tau,
                                              SquareRootWorkspace<T>& ws, SquareRoot<T>& at) {
  using Kind = typename LoweredLink<S>::Kind;
  const LoweredLink<S>& link = model.link(k);
  auto rows = [&] {
    if constexpr (slides)
      return measure_slide<noise>(at.P, T(model.body(k).r));
    else
      return measure_turn<noise>(at.P, T(model.body(k).r));
  }();
  measure<noise, slides>(model, k, tau, ws, at, rows);
  if (link.parent < 0) return;
  if constexpr (!noise) {
    const int index = model.link(link.parent).branch;
    const bool others = index >= 0 && ws.sums[index].begun;
    if (link.kind == Kind::cyclic && model.link(link.parent).massless && !others) {
      cycle_rows<slides, S>(rows, at.P);
      at.z = cycle(at.z);
      return;
    }
  }
  give_to_parent(model, k, ws, rows, at);
}

// The slides of a free joint, whose last DoF is k, by (1') one after another: rows a, b, c of any
// beta make up P, and are absorbed by pivots of least weight.
template <class T, class S, class A, class B, class C>
KALMARM_INLINE void cross_slides(const SquareRootModel<S>& model, int k, const T* tau,
                                 SquareRootWorkspace<T>& ws, SquareRoot<T>& at, const A& a,
                                 const B& b, const C& c) {
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

// Across a ball or free joint in one block step (three_axes.hpp). Of a ball joint the columns z, y
// and x are eliminated in turn as in (1); the rows l1, l2, l3 with alpha = 0 remain. Of a free
// joint no row remains.
template <class T, class S>
KALMARM_NOINLINE KALMARM_SWEEP void cross_at_once(const SquareRootModel<S>& model,
                                                  const LinkRun& run, const T* tau,
                                                  SquareRootWorkspace<T>& ws, SquareRoot<T>& at) {
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
  const auto turned = [&](const auto& row) KALMARM_INLINE_LAMBDA {
    const auto& R = phi.R.R;
    const auto entry = [&](int i) KALMARM_INLINE_LAMBDA {
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

// D, g, e+ of every link.
template <class T, class S>
KALMARM_SWEEP void filter(const SquareRootModel<S>& model, const T* tau,
                          SquareRootWorkspace<T>& ws) {
  ws.margin = T(S(1));
  for (auto& sum : ws.sums) sum.begun = false;
  SquareRoot<T> at;
  bool carried = false;  // `at` comes from link k + 1
  const auto begin = [&](int k) KALMARM_INLINE_LAMBDA {
    const int index = model.link(k).branch;
    if (carried) return;
    if (index >= 0 && ws.sums[index].begun)
      at = ws.sums[index];
    else
      start(model, k, ws, at);
  };
  const auto leave = [&](int k) KALMARM_INLINE_LAMBDA {
    const int parent = model.link(k).parent;
    carried = model.link(k).hangs_on_previous;
    if (carried || parent < 0) return;
    auto& sum = ws.sums[model.link(parent).branch];
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
      const LoweredLink<S>& link = model.link(k);
      begin(k);
      const int index = link.parent < 0 ? -1 : model.link(link.parent).branch;
      const bool aligned =
          link.aligned && !model.factored(k).light_parent && !(index >= 0 && ws.sums[index].begun);
      if (aligned && link.has_noise)
        cross_aligned<true>(model, k, tau[k], ws, at);
      else if (aligned)
        cross_aligned<false>(model, k, tau[k], ws, at);
      else if (link.slides && link.has_noise)
        cross_any<true, true>(model, k, tau[k], ws, at);
      else if (link.slides)
        cross_any<true, false>(model, k, tau[k], ws, at);
      else if (link.has_noise)
        cross_any<false, true>(model, k, tau[k], ws, at);
      else
        cross_any<false, false>(model, k, tau[k], ws, at);
      leave(k);
    }
  }
}

}  // namespace detail

// a (nv) from q (nq), qd (nv) and tau (nv), all numbers in T: one state, or one in every lane. Where
// ws.margin > 0 no D is lost in rounding.
template <class T, class S>
void square_root_acceleration(const SquareRootModel<S>& model, const T* q, const T* qd,
                              const T* tau, SquareRootWorkspace<T>& ws, T* a) {
  detail::set_placements(model, q, ws);
  detail::set_velocity(model, qd, ws);
  detail::filter(model, tau, ws);
  detail::smooth(model, ws, a);
}

// The factors at q (nq). ws has never seen a velocity: the bias is zero, and so is tau.
template <class S>
void square_root_factor(const SquareRootModel<S>& model, const S* q, const std::vector<S>& zeros,
                        SquareRootWorkspace<S>& ws, FastFactors<S>& factors) {
  detail::set_placements(model, q, ws);
  detail::filter(model, zeros.data(), ws);
  static_cast<Placements<S>&>(factors) = ws;
  for (int k = 0; k < model.nv(); ++k)
    factors.links[k] = {ws.links[k].d, ws.links[k].inverse_D, ws.links[k].g};
  factors.margin = ws.margin;
}

}  // namespace kalmarm
