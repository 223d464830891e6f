// phi(parent,k) of the fast path on P, P+ -> phi P+ phi', for a placement by screws (lowered_model.hpp) and
// for one by a matrix that depends on the state.
#pragma once

#include "algorithms/fast/covariance/congruence.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

namespace detail {

// phi P+ phi'. zeros: whether zero terms of phi are tested for and left out.
template <bool zeros, class T, class R, class L, class S, class C, class D>
KALMARM_INLINE Articulated<T> to_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                        const Turn<C>& joint, const D& d,
                                        Articulated<T, R, L>& P_plus) {
  using Tilt = typename LoweredLink<S>::Tilt;
  if constexpr (zeros) {
    if (d != S(0)) translate_z(d, P_plus);
  } else {
    translate_z(d, P_plus);
  }
  rotate_z(joint, P_plus);
  Articulated<T> P;
  if (zeros && link.tilt == Tilt::right)
    P = rotate_x_right(P_plus.full());
  else if (zeros && link.tilt == Tilt::none)
    P = P_plus.full();
  else
    P = rotate_x(link.alpha, P_plus);
  if (link.turned) rotate_z(model.uncommon(link).theta, P);
  if (!zeros || link.p[0] != S(0)) translate_x(link.p[0], P);
  if (link.p[1] != S(0)) translate_y(link.p[1], P);
  if (link.p[2] != S(0)) translate_z(link.p[2], P);
  return P;
}

// phi P+ phi'.
template <class T>
KALMARM_NOINLINE void to_parent(const MatrixPlacement<T>& phi, Articulated<T>& P) {
  rotate(phi.R, P);
  translate_x(phi.p[0], P);
  translate_y(phi.p[1], P);
  translate_z(phi.p[2], P);
}

}  // namespace detail

}  // namespace kalmarm
