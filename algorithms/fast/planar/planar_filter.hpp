// Filter and smoother of a planar mechanism in world axes: 3-vectors (moment about n; force), no
// rotation at all, P of six numbers, [J b'; b C]. t, c and f are of planar_state.hpp, g, P+ and D
// of planar_joint.hpp. Tips to base:
//
//   e = tau - H z-,  z+ = z- + g e + P+ c                                      (4.2), (4.5)
//   H z+ = (H g) tau + (r / D) H z- + H P+ c                                   as in filter.hpp
//   b-(parent) += b+ + C+ t,  J-(parent) += J+ + 2 t'b+ + t'C+ t               phi P+ phi', (3.6)
//   z-(parent) += z+, the moment + t'z+                                        (4.4)
// base to tips:
//   l+ = l-(parent) + c, the linear part + t alpha                             (4.10)
//   a = e / D - g'l+,  l- = l+ + H'a                                           (4.9), (4.11)
// At a hinge with r = 0, alpha = e / D - g'l+ of the linear part alone, and a is what it differs by
// from the parent's. About 122 flops a hinge, and its sine and cosine.
#pragma once

#include <vector>

#include "algorithms/fast/planar/planar_joint.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

namespace detail {

// (2) of covariance/rounding_test.hpp in the plane, of P- with J and the trace of C: what is pending at
// link k becomes what is pending at its parent. reach: of t, as of LoweredBody.
template <bool slides, class T>
KALMARM_INLINE T hand_on(const PlanarWeights<T>& w, const T& e, const T& J, const T& trace,
                         const T& reach, bool noise, const typename PlanarWorkspace<T>::Link& at,
                         HandedOn<T>& pending) {
  const T two = T(2), most = T(1);
  T h = slides ? T(pending.force + trace) : T(pending.moment + J + w.reach * trace);
  h = zero_where_less(e, most, h);
  const T of_moments = slides || noise ? T(at.g.n * at.g.n) : T(0);
  const T of_forces = slides ? T(at.g.y * at.g.y) : T(at.g.x * at.g.x + at.g.y * at.g.y);
  const T moment = two * (pending.moment + J + h * of_moments);
  const T force = two * (pending.force + trace + h * of_forces);
  pending = {zero_where_less(e, most, T(two * moment + reach * force)),
             zero_where_less(e, most, force)};
  return rounding_unit<T>() * h;
}

// (1) to (3) there.
template <bool slides, class T>
KALMARM_INLINE void test_D(const PlanarWeights<T>& w, const T& J, const T& trace, const T& reach,
                           bool noise, const typename PlanarWorkspace<T>::Link& at,
                           HandedOn<T>& pending, T& margin) {
  using std::min;
  const T moved = slides ? T(J + reach * trace) : J;
  const T e = (w.n * moved + w.force * trace) +
              (w.pending_moment * pending.moment + w.pending_force * pending.force);
  margin = min(margin, T(at.D - hand_on<slides>(w, e, J, trace, reach, noise, at, pending)));
}

// Across joint k and to the parent's origin, where the parent's own body is added. Where J+ = 0, J-
// of the parent is t'C-t - (t'b)^2 / D, which depends on no result but the division.
template <bool forces, bool slides, bool noise, class T>
KALMARM_INLINE void cross(const PlanarLink<T>& link, const PlanarStep<T>& step,
                          const PlanarBody<T>& there, const T& tau, PlanarWorkspace<T>& ws, int k,
                          PlanarInertia<T>& P, Planar<T>& z, HandedOn<T>& pending, T& margin) {
  constexpr bool full = slides || noise;  // J+ and b+ are not zero
  auto& at = ws.links[k];
  const T trace = P.xx + P.yy, J_minus = P.J;
  T ux, uy, reach = link.reach, J = there.J, tb;
  if constexpr (slides) {
    ux = ws.apart[link.apart].ux;
    uy = ws.apart[link.apart].uy;
    reach = ws.apart[link.apart].reach;
    measure_slide<noise>(link.r, ux, uy, P, at);
  } else {
    if constexpr (!full) {
      J += across(step, P);
      tb = step.tx * P.x + step.ty * P.y;
    }
    measure_turn<noise>(link.r, P, at);
  }
  if (link.weights.tested)
    test_D<slides>(link.weights, J_minus, trace, reach, noise, at, pending, margin);
  if constexpr (forces) {
    assign(ws.z[k], z);
    const T kept = link.r * at.inverse_D;
    if constexpr (slides)
      at.e = gain_slide<noise>(ux, uy, at.g, kept, tau, z) * at.inverse_D;
    else
      at.e = gain_turn<noise>(at.g, kept, T(link.sign * tau), z) * at.inverse_D;
    add_times<full>(z, P, step);
    z.n += step.tx * z.x + step.ty * z.y;
    z.x += there.fx;
    z.y += there.fy;
  }
  if constexpr (full)
    P.J += J + (T(2) * (step.tx * P.x + step.ty * P.y) + across(step, P));
  else
    P.J = J - (tb * tb) * at.inverse_D;
  move_b<full>(step, there, P);
  P.xx += there.m;
  P.yy += there.m;
}

// D and g of every link, and ws.margin; with forces e+ too.
template <bool forces, class T>
KALMARM_SWEEP void filter(const PlanarModel<T>& model, const T* tau, PlanarWorkspace<T>& ws) {
  const T zero = T(0);
  PlanarInertia<T> P;
  Planar<T> z;
  HandedOn<T> pending;
  T margin = T(1);
  for (auto& branch : ws.branches) {
    branch.P = {zero, zero, zero, zero, zero, zero};
    branch.z = {zero, zero, zero};
    branch.pending = HandedOn<T>::none();
  }
  bool carried = false;  // P and z come from link k + 1, and link k is added
  for (int k = model.nv() - 1; k >= 0; --k) {
    const PlanarLink<T>& link = model.link(k);
    if (!carried) {
      const PlanarBody<T> body = ws.template body<forces>(link, k);
      P.J = body.J;
      P.x = body.x;
      P.y = body.y;
      P.xx = P.yy = body.m;
      P.xy = z.n = zero;
      z.x = body.fx;
      z.y = body.fy;
      pending = HandedOn<T>::none();
    }
    if (link.branch >= 0) {
      const auto& branch = ws.branches[link.branch];
      add(P, branch.P);
      if constexpr (forces) add(z, branch.z);
      pending.add(branch.pending);
    }
    carried = link.hangs_on_previous;
    PlanarBody<T> there{zero, zero, zero, zero, zero, zero};
    if (carried) there = ws.template body<forces>(model.link(k - 1), k - 1);
    PlanarStep<T> step{zero, zero, zero, zero, zero, zero, zero};
    if (link.parent >= 0) step = ws.step(link, k);
    T force = zero;
    if constexpr (forces) force = tau[link.dof];
    const auto across = [&]<bool slides, bool noise>() KALMARM_INLINE_LAMBDA {
      cross<forces, slides, noise>(link, step, there, force, ws, k, P, z, pending, margin);
    };
    if (link.slides)
      link.has_noise ? across.template operator()<true, true>()
                     : across.template operator()<true, false>();
    else
      link.has_noise ? across.template operator()<false, true>()
                     : across.template operator()<false, false>();
    if (link.parent < 0 || carried) continue;
    auto& branch = ws.branches[model.link(link.parent).branch];
    add(branch.P, P);
    if constexpr (forces) add(branch.z, z);
    branch.pending.add(pending);
  }
  ws.margin = margin;
}

template <class T, class G>
KALMARM_INLINE T smooth(const PlanarWorkspace<G>& ws, const PlanarLink<G>& link,
                        const PlanarStep<G>& step, const Planar<G>& g, const T& e_plus,
                        Planar<T>& l) {
  if (!link.slides) return smooth_turn(link, g, step, e_plus, l);
  const auto& apart = ws.apart[link.apart];
  return smooth_slide(link, apart.ux, apart.uy, g, step, e_plus, l);
}

// Of the terms of g'l+, that of its own direction too.
template <class T, class G>
KALMARM_INLINE T squares_of_terms(const PlanarWorkspace<G>& ws, const PlanarLink<G>& link,
                                  const PlanarStep<G>& step, const Planar<G>& g,
                                  const Planar<T>& l) {
  const auto square = [](const T& x) KALMARM_INLINE_LAMBDA { return x * x; };
  const T x = l.x + step.tx * l.n, y = l.y + step.ty * l.n;
  if (!link.slides)
    return square(link.has_noise ? T(g.n * l.n) : l.n) + (square(g.x * x) + square(g.y * y));
  const auto& apart = ws.apart[link.apart];
  const T along = apart.ux * x + apart.uy * y, aside = apart.ux * y - apart.uy * x;
  return square(g.n * l.n) +
         (square(link.has_noise ? T(g.x * along) : along) + square(g.y * aside));
}

// l and a of every link, |a|^2 and E.
template <class T>
void smooth(const PlanarModel<T>& model, PlanarWorkspace<T>& ws, T* a) {
  Planar<T> l;
  T squares = T(0), energy = T(0);
  for (int k = 0; k < model.nv(); ++k) {
    const PlanarLink<T>& link = model.link(k);
    const auto& at = ws.links[k];
    PlanarStep<T> step{};
    if (link.parent < 0) {
      l.n = T(0);
      l.x = model.a0_x();
      l.y = model.a0_y();
    } else {
      if (!link.hangs_on_previous) assign(l, ws.branches[model.link(link.parent).branch].l);
      step = ws.step(link, k);
      l.x += step.cx;
      l.y += step.cy;
    }
    energy += at.D * (at.e * at.e + squares_of_terms(ws, link, step, at.g, l));
    const T acceleration = smooth(ws, link, step, at.g, at.e, l);
    a[link.dof] = acceleration;
    squares += acceleration * acceleration;
    if (link.branch >= 0) assign(ws.branches[link.branch].l, l);
  }
  ws.squares = squares;
  ws.energy = energy;
}

}  // namespace detail

// a of the DoF in the plane from q, qd and tau, all indexed by the DoF of the whole model.
template <class T>
void planar_acceleration(const PlanarModel<T>& model, const T* q, const T* qd, const T* tau,
                         PlanarWorkspace<T>& ws, T* a) {
  detail::set_state<true>(model, q, qd, ws);
  detail::filter<true>(model, tau, ws);
  detail::smooth(model, ws, a);
}

// D and g of the DoF in the plane, and where the links are. About 61 flops a hinge.
template <class T>
void planar_factor(const PlanarModel<T>& model, const T* q, PlanarWorkspace<T>& ws) {
  detail::set_state<false, T>(model, q, nullptr, ws);
  detail::filter<false, T>(model, nullptr, ws);
}

}  // namespace kalmarm
