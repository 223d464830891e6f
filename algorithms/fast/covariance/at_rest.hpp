// Forward dynamics where all velocities are zero, by the conventional form (forward_dynamics.hpp):
// w, c and b vanish, and what is left of (4.2) to (4.11) is
//   e = tau - H z-,  z+ = z- + g e,  z-(parent) += phi z+          tips to base, z- = 0 at the tips
//   a = e / D - g' l+,  l+ = phi' l-(parent)                       base to tips, from -gravity
// with the filter's g and D. About 290 flops a hinge that is an heir, and its sine and cosine.
#pragma once

#include "algorithms/structured/dynamics.hpp"

namespace kalmarm {

namespace detail {

// The filter's rider: torques alone.
template <class T, class S>
struct RestingForces : BiasedForces<T, S> {
  using typename BiasedForces<T, S>::Load;

  [[gnu::always_inline]] void begin(int, Load& z) const {
    z.x = z.y = z.z = z.u = z.v = z.w = T(S(0));
  }
  void add_body(int, Load&) const {}

  template <bool slides, bool noise, class P_plus>
  [[gnu::always_inline]] void measured(int k, const Sixfold<T>& g, const T& inverse_D,
                                       const P_plus&, Load& z) const {
    this->ws.links[k].e = gain<slides, noise>(g, this->tau[k], z) * inverse_D;
  }
};

}  // namespace detail

// A form of StructuredDynamics, StructuredBatch and StructuredSolver: `acceleration` does not look
// at qd, and answers as if it were zero.
struct AtRest : CovarianceForm {
  static constexpr bool at_rest = true;

  template <class T, class S>
  static void acceleration(const StructuredModel<S>& model, const T* q, const T*, const T* tau,
                           Workspace<T>& ws, T* a) {
    detail::set_placements(model, q, ws);
    detail::filter<T>(model, ws, detail::RestingForces<T, S>{{model, tau, ws}});
    detail::smooth<at_rest>(model, ws, a);
  }
};

}  // namespace kalmarm
