// K and L as matrices, (3.1) to (3.3), and their derivatives along the direction of
// factor_direction.hpp. Column m of both is what g(m) does inboard of joint m:
//
//   K(k,m) = H(k) phi(k,m) g(m):    x = g(m), then inwards x <- phi x, K = H x
//   L(k,m) = H(k) psi(k-,m+) g(m):  the same, and x <- (I - gH) x behind every joint
// with dx = dg(m) at first, dx <- phi dx, and behind a joint of the closed loop
//   dx <- (I - gH) dx - dg H x
// Joints are numbered base to tips here: K and L are strictly upper triangular.
//
// A reference for the tests, in O(N depth): no algorithm forms K or L, nor asks for their
// derivatives.
#pragma once

#include "algorithms/study/derivatives/factor_direction.hpp"

namespace kalmarm {

enum class Loop { open, closed };  // K, L

// K or L and its derivative (nv x nv each; every entry is written), after factor_direction. 84
// flops a pair of a joint and one inboard of it, 120 with the loop closed.
template <class T>
void gain_operator(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
                   const FactorDirection<T>& direction, Loop loop,
                   std::type_identity_t<Eigen::Ref<MatrixX<T>>> out,
                   std::type_identity_t<Eigen::Ref<MatrixX<T>>> d_out) {
  out.setZero();
  d_out.setZero();
  for (int m = 0; m < model.nv(); ++m) {
    Vector6<T> x = gains.g[m], dx = direction.dg[m];
    for (int child = m, k = model.parent(m); k >= 0; child = k, k = model.parent(k)) {
      const int h = model.joint(k).axis();
      x = kin.phi[child].force_to_parent(x);
      dx = kin.phi[child].force_to_parent(dx);
      const T Hx = out(k, m) = x[h], dHx = d_out(k, m) = dx[h];
      if (loop == Loop::open) continue;
      x -= gains.g[k] * Hx;
      dx -= gains.g[k] * dHx + direction.dg[k] * Hx;
    }
  }
}

}  // namespace kalmarm
