// One joint of a planar mechanism, for the sweeps of planar_filter.hpp and planar_columns.hpp. A
// hinge measures the moment, H = (1; 0), a slide the force along its axis u, H = (0; u).
//
//   D = J + r,         g = (J; b) / D,              C+ = C - b b' / D          at a hinge
//   D = u'C u + r,     g = (b'u; C u) / D,          the same in the axes u and v, across u
//   P+ = [0 0; 0 C+] at a hinge with r = 0, P+ (0; u) = 0 at a slide with r = 0; else H P+ = r g'
#pragma once

#include "algorithms/fast/planar/planar_state.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

namespace detail {

// Across a hinge: P- becomes P+; D, g are kept.
template <bool noise, class T>
KALMARM_INLINE void measure_turn(const T& r, PlanarInertia<T>& P,
                                 typename PlanarWorkspace<T>::Link& at) {
  const T D = noise ? T(P.J + r) : P.J, inverse_D = T(1) / D;
  // The products do not wait for the division.
  const T xx = P.x * P.x, xy = P.x * P.y, yy = P.y * P.y;
  at.D = D;
  at.inverse_D = inverse_D;
  at.g.x = P.x * inverse_D;
  at.g.y = P.y * inverse_D;
  P.xx = P.xx - xx * inverse_D;
  P.xy = P.xy - xy * inverse_D;
  P.yy = P.yy - yy * inverse_D;
  if constexpr (noise) {
    at.g.n = P.J * inverse_D;
    P.J = r * at.g.n;
    P.x = r * at.g.x;
    P.y = r * at.g.y;
  }
}

// Across a slide along u; v = (-u_y, u_x).
template <bool noise, class T>
KALMARM_INLINE void measure_slide(const T& r, const T& ux, const T& uy, PlanarInertia<T>& P,
                                  typename PlanarWorkspace<T>::Link& at) {
  const T sx = P.xx * ux + P.xy * uy, sy = P.xy * ux + P.yy * uy;
  const T uu = sx * ux + sy * uy, uv = sy * ux - sx * uy;
  const T vv = (P.xx * uy - P.xy * ux) * uy + (P.yy * ux - P.xy * uy) * ux;
  const T u = P.x * ux + P.y * uy, v = P.y * ux - P.x * uy;
  const T D = noise ? T(uu + r) : uu, inverse_D = T(1) / D;
  at.D = D;
  at.inverse_D = inverse_D;
  at.g.n = u * inverse_D;
  at.g.y = uv * inverse_D;
  P.J = P.J - at.g.n * u;
  const T v_plus = v - at.g.n * uv, vv_plus = vv - at.g.y * uv;
  P.x = -(v_plus * uy);
  P.y = v_plus * ux;
  P.xx = vv_plus * uy * uy;
  P.xy = -(vv_plus * ux * uy);
  P.yy = vv_plus * ux * ux;
  if constexpr (noise) {
    at.g.x = uu * inverse_D;
    const T u_plus = r * at.g.n, uu_plus = r * at.g.x, uv_plus = r * at.g.y;
    P.x += u_plus * ux;
    P.y += u_plus * uy;
    P.xx += ux * (uu_plus * ux - T(2) * uv_plus * uy);
    P.xy += uu_plus * ux * uy + uv_plus * (ux * ux - uy * uy);
    P.yy += uy * (uu_plus * uy + T(2) * uv_plus * ux);
  }
}

// z- becomes z+, P+ c apart; e is returned.
template <bool noise, class T, class G>
KALMARM_INLINE T gain_turn(const Planar<G>& g, const G& kept, const T& tau, Planar<T>& z) {
  const T e = tau - z.n;
  z.x += g.x * e;
  z.y += g.y * e;
  z.n = noise ? T(g.n * tau + kept * z.n) : tau;
  return e;
}

template <bool noise, class T, class G>
KALMARM_INLINE T gain_slide(const G& ux, const G& uy, const Planar<G>& g, const G& kept,
                            const T& tau, Planar<T>& z) {
  const T u = ux * z.x + uy * z.y, e = tau - u;
  const T along = noise ? T(g.x * tau + kept * u) : tau, aside = (ux * z.y - uy * z.x) + g.y * e;
  z.n += g.n * e;
  z.x = along * ux - aside * uy;
  z.y = along * uy + aside * ux;
  return e;
}

// z += P+ c, and to the parent. full: J+ and b+ are not zero.
template <bool full, class T>
KALMARM_INLINE void add_times(Planar<T>& z, const PlanarInertia<T>& P, const PlanarStep<T>& step) {
  z.x += P.xx * step.cx + P.xy * step.cy;
  z.y += P.xy * step.cx + P.yy * step.cy;
  if constexpr (full) z.n += P.x * step.cx + P.y * step.cy;
}

// t'C t.
template <class T>
KALMARM_INLINE T across(const PlanarStep<T>& step, const PlanarInertia<T>& P) {
  return step.tt_xx * P.xx + (step.tt_xy * P.xy + step.tt_yy * P.yy);
}

// b of P+ at the parent's origin, and what is there.
template <bool full, class T>
KALMARM_INLINE void move_b(const PlanarStep<T>& step, const PlanarBody<T>& there,
                           PlanarInertia<T>& P) {
  T x = step.tx * P.xx + there.x, y = step.tx * P.xy + there.y;
  x += step.ty * P.xy;
  y += step.ty * P.yy;
  if constexpr (full) {
    x += P.x;
    y += P.y;
  }
  P.x = x;
  P.y = y;
}

// a, and l- of the parent becomes l- of the link. The parent's l.n is known last, so the terms that
// depend on it are kept apart: few operations wait for it.
template <class T, class G>
KALMARM_INLINE T smooth_turn(const PlanarLink<G>& link, const Planar<G>& g,
                             const PlanarStep<G>& step, const T& e_plus, Planar<T>& l) {
  const T rest = e_plus - g.x * l.x - g.y * l.y, before = l.n;
  const G gt = g.x * step.tx + g.y * step.ty;
  l.x += step.tx * before;
  l.y += step.ty * before;
  if (link.has_noise) {
    const T a = rest - (gt + g.n) * before;
    l.n += a;
    return link.sign * a;
  }
  l.n = rest - gt * before;
  return link.sign * (l.n - before);
}

template <class T, class G>
KALMARM_INLINE T smooth_slide(const PlanarLink<G>& link, const G& ux, const G& uy,
                              const Planar<G>& g, const PlanarStep<G>& step, const T& e_plus,
                              Planar<T>& l) {
  l.x += step.tx * l.n;
  l.y += step.ty * l.n;
  const T along = ux * l.x + uy * l.y, aside = ux * l.y - uy * l.x;
  const T rest = e_plus - g.n * l.n - g.y * aside;
  const T a = link.has_noise ? T(rest - g.x * along) : T(rest - along);
  l.x += ux * a;
  l.y += uy * a;
  return a;
}

}  // namespace detail

}  // namespace kalmarm
