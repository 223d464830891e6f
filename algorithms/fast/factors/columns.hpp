// M^-1 tau for as many tau as T has lanes, on factors of U: filter and smoother of filter.hpp
// without bias. Every lane is a column; D, g and phi are the same for all.
//
//   e = (tau - H z-) / D,  z-(parent) += phi z+              tips to base
//   a = e - g' l+,  l+ = phi' l-(parent)                     base to tips
// In a column of M^-1, tau is a unit vector: the first sweep visits the links on the path to the
// base alone, and the second one only has to go as far as the diagonal. About 43 flops a link and
// lane in each, at an aligned hinge (lowered_model.hpp).
#pragma once

#include <vector>

#include "algorithms/fast/factors/factors.hpp"
#include "algorithms/fast/kinematics/column_lanes.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

namespace detail {

// z- becomes z+; e is returned. at: d, g and 1 / D of link k.
template <class T, class S, class Link>
KALMARM_INLINE T gain(const LoweredModel<S>& model, int k, const Link& at, const T& tau,
                      Sixfold<T>& z) {
  const LoweredLink<S>& link = model.link(k);
  const auto& none = at.inverse_D;
  if (!link.has_noise)
    return link.slides ? gain<true, false>(at.g, none, tau, z)
                       : gain<false, false>(at.g, none, tau, z);
  const auto kept = none * model.body(k).r;
  return link.slides ? gain<true, true>(at.g, kept, tau, z) : gain<false, true>(at.g, kept, tau, z);
}

// Factors: Placements<U> with links of (d, g, inverse_D), as FastFactors<U> is and what a sweep of
// forward dynamics has left in its CovarianceWorkspace<U>.

// Sees z- of every link, e before it is divided by D, and then e+ and l+.
struct Unobserved {
  template <class Z>
  void gathered(int, const Z&) const {}
  template <class T>
  void measured(int, const T&) const {}
  template <class T, class L>
  void moved(int, const T&, const L&) const {}
};

// e of the links up to `last`, of which those with visits[k] have a tau(k) outboard that is not 0.
template <class T, class S, class Factors, class Tau, class Observer = Unobserved>
void sweep_inward(const LoweredModel<S>& model, const Factors& factors, int last,
                  const char* visits, const Tau& tau, ColumnsWorkspace<T>& ws,
                  const Observer& observer = {}) {
  for (auto& branch : ws.branches) set_zero(branch.z);
  Sixfold<T> z;
  set_zero(z);
  bool carried = false;  // z comes from link k + 1
  for (int k = last; k >= 0; --k) {
    if (!visits[k]) {
      ws.e[k] = T(0);
      carried = false;
      continue;
    }
    const LoweredLink<S>& link = model.link(k);
    const auto& at = factors.links[k];
    if (!carried) set_zero(z);
    if (link.branch >= 0) add(z, ws.branches[link.branch].z);
    observer.gathered(k, z);
    const T e = gain(model, k, at, T(tau(k)), z);
    observer.measured(k, e);
    ws.e[k] = e * at.inverse_D;
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    force_to_parent(model, link, factors, at.d, z);
    if (!carried) add(ws.branches[model.link(link.parent).branch].z, z);
  }
}

// write(k, a) of the links up to `last`.
template <class T, class S, class Factors, class Write, class Observer = Unobserved>
KALMARM_INLINE void sweep_outward(const LoweredModel<S>& model, const Factors& factors, int last,
                                  ColumnsWorkspace<T>& ws, const Write& write,
                                  const Observer& observer = {}) {
  Sixfold<T> l;
  set_zero(l);
  for (int k = 0; k <= last; ++k) {
    const LoweredLink<S>& link = model.link(k);
    const auto& at = factors.links[k];
    if (link.parent < 0)
      set_zero(l);
    else if (!link.hangs_on_previous)
      assign(l, ws.branches[model.link(link.parent).branch].l);
    if (link.parent >= 0) motion_from_parent(model, link, factors, at.d, l);
    observer.moved(k, ws.e[k], l);
    write(k, smooth(link, at.g, ws.e[k], l));
    if (link.branch >= 0) assign(ws.branches[link.branch].l, l);
  }
}

}  // namespace detail

}  // namespace kalmarm
