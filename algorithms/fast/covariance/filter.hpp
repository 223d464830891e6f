// The filter of the fast path, tips to base: P of articulated.hpp, (3.6) and (3.10). It stores g(k)
// of every link and
//   margin = min over joints of what rounding_test.hpp says
// D may be lost in rounding where it is not positive. A policy
// says what is propagated along with P, and what is done with D and g: forces with bias
// (forward_dynamics.hpp), forces without (at_rest.hpp), nothing (factors.hpp). It has a type Load
// of z and
//   begin_all(), has_done(k)                        links that the policy filters by itself, first
//   begin(k, z), add_body(k, z)                     z- starts at link k, or comes from link k + 1
//   add_branch(index, z), keep(index, z)            sums over children other than k + 1, which begin_all
//                                                   begins; `index`: of the sum in ws.branches
//   measured<slides, noise>(k, g, 1/D, P+, z)       z- becomes z+; P+ where c is not zero
//   to_parent(link, joint, d, z), cycle(z), to_parent(phi, z)       z+ becomes z- of the parent
// and may have r(k), a lane's own joint noise in place of the model's.
// One step each way on any z and l is here too, for policies and for sweeps on stored factors:
//   z+ = z- + g e,  e = tau - H z-,  H z+ = (H g) tau + (r / D) H z-       (4.2), (4.5)
//   a  = e / D - g' l+,  l- = l+ + H' a                                    (4.9), (4.11)
// Where r = 0, H l- = e / D - sum over j != h of g_j l+_j.
#pragma once

#include <vector>

#include "algorithms/fast/covariance/measurement.hpp"
#include "algorithms/fast/covariance/rounding_test.hpp"
#include "algorithms/fast/covariance/three_axes.hpp"
#include "algorithms/fast/kinematics/placements.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

namespace detail {

// z- becomes z+, P+ c apart; e is returned. kept: r / D, looked at where there is noise, since
//   H z+ = (H g) tau + (r / D) H z-
// is a mean, where H z- + (H g) e would cancel before a small rotor and tau - (r / D) e before a large
// one: the parent would feel the rounding of forces that it does not carry. G: type of g, T or its
// scalar.
template <bool slides, bool noise, class T, class G>
KALMARM_INLINE T gain(const Sixfold<G>& g, const G& kept, const T& tau, Sixfold<T>& z) {
  const T e = tau - (slides ? z.w : z.z);
  z.x += g.x * e;
  z.y += g.y * e;
  z.u += g.u * e;
  z.v += g.v * e;
  if constexpr (slides) {
    z.z += g.z * e;
    z.w = noise ? T(g.w * tau + kept * z.w) : tau;
  } else {
    z.w += g.w * e;
    z.z = noise ? T(g.z * tau + kept * z.z) : tau;
  }
  return e;
}

// a, and l+ becomes l-.
template <class T, class S, class G>
KALMARM_INLINE T smooth(const LoweredLink<S>& link, const Sixfold<G>& g, const T& e_plus,
                        Sixfold<T>& l) {
  const bool exact = !link.has_noise;
  T a;
  if (link.slides) {
    const T rest = ((e_plus - g.x * l.x - g.y * l.y) - g.z * l.z) - (g.u * l.u + g.v * l.v);
    a = exact ? rest - l.w : rest - g.w * l.w;
    l.w = exact ? rest : l.w + a;
  } else {
    const T rest = ((e_plus - g.x * l.x - g.y * l.y) - g.w * l.w) - (g.u * l.u + g.v * l.v);
    a = exact ? rest - l.z : rest - g.z * l.z;
    l.z = exact ? rest : l.z + a;
  }
  return a;
}

// r of link k: the policy's where it has its own, else the model's.
template <class S, class Policy>
KALMARM_INLINE decltype(auto) joint_noise(const LoweredBody<S>& body, const Policy& policy, int k) {
  if constexpr (requires { policy.r(k); })
    return policy.r(k);
  else
    return (body.r);
}

// Across the joint of link k: g is kept, P- becomes P+ in the parent's frame.
template <bool slides, bool noise, bool zeros, class T, class S, class Workspace, class Policy>
KALMARM_INLINE void cross(const LoweredModel<S>& model, int k, Workspace& ws, Articulated<T>& P,
                          HandedOn<T>& pending, typename Policy::Load& z, const Policy& policy) {
  using Kind = typename LoweredLink<S>::Kind;
  const LoweredLink<S>& link = model.link(k);
  const LoweredBody<S>& body = model.body(k);
  auto& at = ws.links[k];
  T D, inverse_D;
  Sixfold<T> g;
  auto P_plus = [&]() KALMARM_INLINE_LAMBDA {
    if constexpr (slides)
      return measure_slide<noise>(P, joint_noise(body, policy, k), D, inverse_D, g);
    else
      return measure_turn<noise>(P, joint_noise(body, policy, k), D, inverse_D, g);
  }();
  at.g = g;
  const bool tested = body.weights.tested;
  if (tested)
    test_D<slides>(body.weights, absorbed<slides>(body.weights, P, at.d), P, D, g, pending,
                   ws.margin);
  policy.template measured<slides, noise>(k, g, inverse_D, P_plus, z);
  if (link.parent < 0) return;

  const T two = T(S(2));
  if (link.kind == Kind::screws) {
    if constexpr (slides) {
      const T reach = body.reach + two * two * at.d * at.d;
      if (tested) pending.move(reach);
      P = to_parent<zeros>(model, link, model.uncommon(link).turn, at.d, P_plus);
      policy.to_parent(link, model.uncommon(link).turn, at.d, z);
    } else {
      if (tested) pending.move(body.reach);
      const Turn<T> joint(ws.cos[link.varying], ws.sin[link.varying]);
      P = to_parent<zeros>(model, link, joint, link.d, P_plus);
      policy.to_parent(link, joint, link.d, z);
    }
  } else if (link.kind == Kind::cyclic) {
    P = cycle(P_plus.full());
    policy.cycle(z);
  } else {
    Articulated<T> rotated = P_plus.full();  // P stays in registers
    const auto& phi = ws.matrices[link.varying];
    to_parent(phi, rotated);
    if (tested) {
      const T pp = phi.p[0] * phi.p[0] + phi.p[1] * phi.p[1] + phi.p[2] * phi.p[2];
      pending.move(T(two * pp));
    }
    P = rotated;
    policy.to_parent(phi, z);
  }
}

// Links without a zero term have code of their own: with 27 numbers in registers, the tests for
// zero terms cost 6 %. SIMD lanes share one version: there twice the code costs more than they do.
template <bool noise, class T, class S, class Workspace, class Policy>
KALMARM_INLINE void cross_hinge(const LoweredModel<S>& model, int k, Workspace& ws,
                                Articulated<T>& P, HandedOn<T>& pending, typename Policy::Load& z,
                                const Policy& policy) {
  using Tilt = typename LoweredLink<S>::Tilt;
  if constexpr (Lanes<T>::count == 1) {
    if (model.link(k).tilt == Tilt::any) {
      cross<false, noise, false>(model, k, ws, P, pending, z, policy);
      return;
    }
  }
  cross<false, noise, true>(model, k, ws, P, pending, z, policy);
}

// State of the sweep between two links.
template <class T, class Load>
struct Carried {
  bool on = false;  // P and z come from link k + 1
  Articulated<T> P;
  HandedOn<T> pending;
  Load z;
};

// P-, z- of link k: its own body, plus child k + 1, plus the sum over other children.
template <class T, class S, class Workspace, class Policy>
KALMARM_INLINE void gather(const LoweredModel<S>& model, int k, bool carried, const Workspace& ws,
                           Articulated<T>& P, HandedOn<T>& pending, typename Policy::Load& z,
                           const Policy& policy) {
  const LoweredLink<S>& link = model.link(k);
  const LoweredBody<S>& body = model.body(k);
  if (!carried) {
    set_body(P, body);
    pending = HandedOn<T>::none();
    policy.begin(k, z);
  } else if (!link.massless) {
    add_body(P, body);
    policy.add_body(k, z);
  }
  if (link.branch >= 0) {
    const auto& branch = ws.branches[link.branch];
    add(P, branch.P);
    pending.add(branch.pending);
    policy.add_branch(link.branch, z);
  }
}

// phi P+ phi' and phi z+ of a link whose parent is not k - 1, added to its parent's sum.
template <class T, class S, class Workspace, class Policy>
KALMARM_INLINE void leave(const LoweredModel<S>& model, int k, Workspace& ws,
                          const Articulated<T>& P, const HandedOn<T>& pending,
                          const typename Policy::Load& z, const Policy& policy) {
  const int index = model.link(model.link(k).parent).branch;
  auto& branch = ws.branches[index];
  policy.keep(index, z);
  add(branch.P, P);
  branch.pending.add(pending);
}

// Links one by one.
template <class T, class S, class Workspace, class Policy>
KALMARM_NOINLINE KALMARM_SWEEP void filter_links(const LoweredModel<S>& model, const LinkRun& run,
                                                 Workspace& ws,
                                                 Carried<T, typename Policy::Load>& from,
                                                 const Policy& policy) {
  Articulated<T> P = from.P;
  HandedOn<T> pending = from.pending;
  typename Policy::Load z = from.z;
  bool carried = from.on;
  for (int k = run.last; k >= run.first; --k) {
    if (policy.has_done(k)) {
      carried = false;
      continue;
    }
    const LoweredLink<S>& link = model.link(k);
    gather(model, k, carried, ws, P, pending, z, policy);
    if (link.slides) {
      if (link.has_noise)
        cross<true, true, false>(model, k, ws, P, pending, z, policy);
      else
        cross<true, false, false>(model, k, ws, P, pending, z, policy);
    } else {
      if (link.has_noise)
        cross_hinge<true>(model, k, ws, P, pending, z, policy);
      else
        cross_hinge<false>(model, k, ws, P, pending, z, policy);
    }
    carried = link.hangs_on_previous;
    if (link.parent >= 0 && !carried) leave(model, k, ws, P, pending, z, policy);
  }
  from = {carried, P, pending, z};
}

// A ball or free joint in one block step (three_axes.hpp).
template <class T, class S, class Workspace, class Policy>
KALMARM_NOINLINE KALMARM_SWEEP void filter_joint(const LoweredModel<S>& model, const LinkRun& run,
                                                 Workspace& ws,
                                                 Carried<T, typename Policy::Load>& from,
                                                 const Policy& policy) {
  gather(model, run.last, from.on, ws, from.P, from.pending, from.z, policy);
  cross_at_once(model, run, ws, from.P, from.pending, from.z, policy);
  const LoweredLink<S>& link = model.link(run.first);
  from.on = link.hangs_on_previous;
  if (link.parent >= 0 && !from.on)
    leave(model, run.first, ws, from.P, from.pending, from.z, policy);
}

// g of every link, and ws.margin.
template <class T, class S, class Workspace, class Policy>
void filter(const LoweredModel<S>& model, Workspace& ws, const Policy& policy) {
  ws.margin = T(S(1));
  for (auto& branch : ws.branches) {
    set_zero(branch.P);
    branch.pending = HandedOn<T>::none();
  }
  policy.begin_all();
  Carried<T, typename Policy::Load> carried;
  for (auto run = model.runs().rbegin(); run != model.runs().rend(); ++run) {
    if (run->at_once)
      filter_joint(model, *run, ws, carried, policy);
    else
      filter_links(model, *run, ws, carried, policy);
  }
}

}  // namespace detail

}  // namespace kalmarm
