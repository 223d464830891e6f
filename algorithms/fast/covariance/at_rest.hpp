// Forward dynamics where all velocities are zero, by the conventional form (forward_dynamics.hpp):
// w, c and b vanish, and what is left of (4.2) to (4.11) is
//   e = tau - H z-,  z+ = z- + g e,  z-(parent) += phi z+          tips to base, z- = -f at the tips, f from outside
//   a = e / D - g' l+,  l+ = phi' l-(parent)                       base to tips, from -gravity
// with the filter's g and D. About 310 flops a hinge that is an aligned child, and its sine and
// cosine.
#pragma once

#include "algorithms/fast/covariance/forward_dynamics.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

namespace detail {

// The filter's policy: torques alone.
template <class T, class S>
struct RestingForces : BiasedForces<T, S> {
  using typename BiasedForces<T, S>::Load;

  void begin_all() const { this->template begin_given<true>(); }
  KALMARM_INLINE void begin(int, Load& z) const { z.x = z.y = z.z = z.u = z.v = z.w = T(S(0)); }
  void add_body(int, Load&) const {}
  T squared_rate(int) const { return T(S(0)); }

  template <bool slides, bool noise, class P_plus>
  KALMARM_INLINE void measured(int k, const Sixfold<T>& g, const T& inverse_D, const P_plus&,
                               Load& z) const {
    watch(this->model, k, z, this->ws);
    auto& at = this->ws.links[k];
    at.inverse_D = inverse_D;
    const T kept = this->model.body(k).r * inverse_D;
    at.e = gain<slides, noise>(g, kept, this->tau[k], z) * inverse_D;
  }
};

}  // namespace detail

// a (nv) from q (nq), tau (nv) and what acts from outside, all numbers in T; ws.margin, ws.noise, ws.energy,
// ws.squares and ws.size say how wrong it may be (engine/acceptance.hpp).
template <class T, class S>
void resting_acceleration(const LoweredModel<S>& model, const T* q, const T* tau,
                          CovarianceWorkspace<T>& ws, T* a, const Acting<T>& acting = {}) {
  detail::set_placements(model, q, ws);
  detail::filter_forces(model, ws, detail::RestingForces<T, S>{{model, tau, ws, acting}});
  detail::smooth<true>(model, ws, a);
}

}  // namespace kalmarm
