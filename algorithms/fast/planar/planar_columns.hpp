// On the factors of planar_filter.hpp: M^-1 tau, for as many tau as T has lanes, the diagonal of
// M^-1, and e = (I - L) of a force at a site, all without bias.
//
//   e = tau - H z-,  z-(parent) += phi (z- + g e)            tips to base      (4.2), (4.4)
//   a = e / D - g'l+,  l+ = phi' l-(parent)                  base to tips      (4.9)
//   Lambda+(k) = phi' Lambda-(parent) phi                                             (5.7)
//   y = Lambda+ g,  M^-1(k,k) = 1 / D + g'y                                           (6.1)
//   Lambda-(k) = Lambda+ - H'y' - (y - H' M^-1(k,k)) H                                (5.6)
// About 26 flops a hinge and lane in the two sweeps, 40 a hinge for the diagonal.
#pragma once

#include <vector>

#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/fast/planar/planar_filter.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class T>
struct PlanarColumns {
  struct Branch {
    Planar<T> z, l;
  };

  std::vector<T> e;
  std::vector<Branch> branches;

  template <class S>
  explicit PlanarColumns(const PlanarModel<S>& model)
      : e(model.nv()), branches(model.branch_count()) {}
};

namespace detail {

template <class T>
KALMARM_INLINE void set_zero(Planar<T>& x) {
  x.n = x.x = x.y = T(0);
}

// z- becomes z+; e is returned. A hinge's tau is turned to its sign.
template <class T, class S>
KALMARM_INLINE T gain(const PlanarWorkspace<S>& ws, const PlanarLink<S>& link, int k, const T& tau,
                      Planar<T>& z) {
  const Planar<S>& g = ws.links[k].g;
  const S kept = link.r * ws.links[k].inverse_D;
  if (!link.slides) {
    const T own = link.sign * tau;
    return link.has_noise ? gain_turn<true>(g, kept, own, z) : gain_turn<false>(g, kept, own, z);
  }
  const S ux = ws.apart[link.apart].ux, uy = ws.apart[link.apart].uy;
  return link.has_noise ? gain_slide<true>(ux, uy, g, kept, tau, z)
                        : gain_slide<false>(ux, uy, g, kept, tau, z);
}

// phi z+.
template <class T, class S>
KALMARM_INLINE void force_to_parent(const PlanarStep<S>& step, Planar<T>& z) {
  z.n += step.tx * z.x + step.ty * z.y;
}

// e / D of the links up to `last`, of which those with visits[k] have a tau outboard that is not 0.
template <class T, class S, class Tau, class Observer = Unobserved>
void sweep_inward(const PlanarModel<S>& model, const PlanarWorkspace<S>& ws, int last,
                  const char* visits, const Tau& tau, PlanarColumns<T>& columns,
                  const Observer& observer = {}) {
  for (auto& branch : columns.branches) set_zero(branch.z);
  Planar<T> z;
  set_zero(z);
  bool carried = false;  // z comes from link k + 1
  for (int k = last; k >= 0; --k) {
    if (!visits[k]) {
      columns.e[k] = T(0);
      carried = false;
      continue;
    }
    const PlanarLink<S>& link = model.link(k);
    if (!carried) set_zero(z);
    if (link.branch >= 0) add(z, columns.branches[link.branch].z);
    observer.gathered(k, z);
    columns.e[k] = gain(ws, link, k, T(tau(k)), z) * ws.links[k].inverse_D;
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    force_to_parent(ws.step(link, k), z);
    if (!carried) add(columns.branches[model.link(link.parent).branch].z, z);
  }
}

// write(k, a) of the links up to `last`.
template <class T, class S, class Write, class Observer = Unobserved>
KALMARM_INLINE void sweep_outward(const PlanarModel<S>& model, const PlanarWorkspace<S>& ws,
                                  int last, PlanarColumns<T>& columns, const Write& write,
                                  const Observer& observer = {}) {
  Planar<T> l;
  set_zero(l);
  for (int k = 0; k <= last; ++k) {
    const PlanarLink<S>& link = model.link(k);
    if (link.parent < 0)
      set_zero(l);
    else if (!link.hangs_on_previous)
      assign(l, columns.branches[model.link(link.parent).branch].l);
    PlanarStep<S> step{};
    if (link.parent >= 0) step = ws.step(link, k);
    observer.moved(k, columns.e[k], squares_of_terms(ws, link, step, ws.links[k].g, l));
    write(k, smooth(ws, link, step, ws.links[k].g, columns.e[k], l));
    if (link.branch >= 0) assign(columns.branches[link.branch].l, l);
  }
}

// Lambda, [n b'; b C] on (angular; linear), and M^-1(k,k) = alpha across a joint.
template <class T>
struct PlanarCovariance {
  T n, x, y, xx, xy, yy;
};

template <class T>
KALMARM_INLINE void from_parent(const PlanarStep<T>& step, PlanarCovariance<T>& L) {
  const T x = L.x + step.tx * L.n, y = L.y + step.ty * L.n;
  L.xx += step.tx * (L.x + x);
  L.xy += step.ty * L.x + step.tx * y;
  L.yy += step.ty * (L.y + y);
  L.x = x;
  L.y = y;
}

template <class T>
KALMARM_INLINE T diagonal_at_turn(const PlanarLink<T>& link,
                                  const typename PlanarWorkspace<T>::Link& at,
                                  PlanarCovariance<T>& L) {
  const T gn = link.has_noise ? at.g.n : T(1);
  const T yn = L.n * gn + L.x * at.g.x + L.y * at.g.y;
  const T yx = L.x * gn + L.xx * at.g.x + L.xy * at.g.y;
  const T yy = L.y * gn + L.xy * at.g.x + L.yy * at.g.y;
  const T alpha = at.inverse_D + gn * yn + at.g.x * yx + at.g.y * yy;
  L.x -= yx;
  L.y -= yy;
  L.n = (L.n - yn) - (yn - alpha);
  return alpha;
}

template <class T>
KALMARM_INLINE T diagonal_at_slide(const PlanarLink<T>& link, const T& ux, const T& uy,
                                   const typename PlanarWorkspace<T>::Link& at,
                                   PlanarCovariance<T>& L) {
  const T gu = link.has_noise ? at.g.x : T(1);
  const T gx = gu * ux - at.g.y * uy, gy = gu * uy + at.g.y * ux;
  const T yn = L.n * at.g.n + L.x * gx + L.y * gy;
  const T yx = L.x * at.g.n + L.xx * gx + L.xy * gy;
  const T yy = L.y * at.g.n + L.xy * gx + L.yy * gy;
  const T alpha = at.inverse_D + at.g.n * yn + gx * yx + gy * yy;
  L.x -= ux * yn;
  L.y -= uy * yn;
  L.xx -= ux * (yx + (yx - alpha * ux));
  L.xy -= ux * (yy - alpha * uy) + uy * yx;
  L.yy -= uy * (yy + (yy - alpha * uy));
  return alpha;
}

}  // namespace detail

// write(k, x) of the diagonal of M^-1. branches: memory for one Lambda per link.branch.
template <class T, class Write>
void planar_diagonal(const PlanarModel<T>& model, const PlanarWorkspace<T>& ws,
                     std::vector<detail::PlanarCovariance<T>>& branches, const Write& write) {
  detail::PlanarCovariance<T> L;
  for (int k = 0; k < model.nv(); ++k) {
    const PlanarLink<T>& link = model.link(k);
    if (link.parent < 0) {
      L = {T(0), T(0), T(0), T(0), T(0), T(0)};
    } else {
      if (!link.hangs_on_previous) L = branches[model.link(link.parent).branch];
      detail::from_parent(ws.step(link, k), L);
    }
    const auto& at = ws.links[k];
    if (link.slides) {
      const auto& apart = ws.apart[link.apart];
      write(k, detail::diagonal_at_slide(link, apart.ux, apart.uy, at, L));
    } else {
      write(k, detail::diagonal_at_turn(link, at, L));
    }
    if (link.branch >= 0) branches[link.branch] = L;
  }
}

// write(k, e) on the way to the base, of a force z at the origin of link `from`, or of a tau
// of link `from` where z is zero.
template <class T, class S, class Write>
void planar_innovations(const PlanarModel<S>& model, const PlanarWorkspace<S>& ws, int from,
                        const T& tau, Planar<T> z, const Write& write) {
  for (int k = from; k >= 0; k = model.link(k).parent) {
    const PlanarLink<S>& link = model.link(k);
    write(k, detail::gain(ws, link, k, k == from ? tau : T(0), z));
    if (link.parent >= 0) detail::force_to_parent(ws.step(link, k), z);
  }
}

}  // namespace kalmarm
