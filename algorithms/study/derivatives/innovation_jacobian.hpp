// The whitened innovations of a torque residual, and their derivatives over theta, r and tau.
//
//   w = D^-1/2 (I - L) Delta,   Delta = tau - ID(q, q', q'')          (3.3): w'w = Delta'M^-1 Delta
// by the filter without bias, tips to base:
//   z-(k) = sum over children c of phi(k,c) z+(c)                     (4.4)
//   e-(k) = Delta(k) - H z-,   w = e- / sqrt D,   e+ = e- / D         (4.2), (4.6)
//   z+(k) = z- + g e-                                                 (4.5)
//
// A change of link b's inertia moves through the closed loop to every joint k inboard:
//   psi(k-,b-) = phi (I - gH) … phi (I - gH)(b)
//   dP-(k) = psi dM psi',   dD = h'dM h,                              h = psi'(k-,b-) H'(k)
//   dg     = (I - gH) dP- H' / D,   dz+ = (I - gH) (dz- + dP- H' e+)
//   dz-(k) = psi(k-,b-) dM s,   s = sum over j from b to below k of psi'(j-,b-) H'(j) e+(j)
// and (I - L) H phi = H psi carries the force df = A dtheta of the body, so that
//   dw(k) = -1/sqrt D(k) (h'A dtheta + h'dM (s + 1/2 e+(k) h))
// h and s go outwards from k, where h = H', s = 0, with h+ = phi'h(parent), s+ = phi's(parent):
//   L(k,b) = g'h+,   h(b) = h+ - H'L(k,b),   s(b) = s+ + H'(e+ - g's+)
// Joint noise acts behind joint b's measurement, where dP+ = g g'dr, dDelta = -q'' dr:
//   dw(k) = 1/sqrt D(k) (L(k,b) (q''(b) + e+(b) - g's+) - 1/2 e+(k) L(k,b)^2) dr(b)
//   dw(b) = -1/sqrt D(b) (q''(b) + 1/2 e+(b)) dr(b)
// Over tau it is D^-1/2 (I - L) itself.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/study/derivatives/regressor.hpp"
#include "algorithms/study/inverse_mass/sweeps.hpp"

namespace kalmarm {

template <class T>
struct Innovations {
  InverseDynamics<T> newton_euler;
  Sweeps<T> sweeps;
  VectorX<T> Delta;

  explicit Innovations(const Model<T>& model)
      : newton_euler(model), sweeps(model), Delta(model.nv()) {}
};

template <class T>
struct InnovationJacobian {
  Subtrees subtrees;
  LinkForces<T> forces;
  std::vector<Vector6<T>> h, s;

  explicit InnovationJacobian(const Model<T>& model)
      : subtrees(model), forces(model), h(model.nv()), s(model.nv()) {}
};

// w (nv values) from qdd and tau (nv values each), from gains of the same state. About 250 flops a
// link.
template <class T, class A, class V>
void innovations(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
                 const A& qdd, const V& tau, Innovations<T>& ws, VectorRef<T> w) {
  using std::sqrt;
  inverse_dynamics(model, kin, qdd, ws.newton_euler, Eigen::Ref<VectorX<T>>(ws.Delta));
  ws.Delta = tau - ws.Delta;
  for (Vector6<T>& z : ws.sweeps.z) z.setZero();
  filter(model, kin, gains, ws.Delta, ws.sweeps, [](int, Vector6<T>&) {});
  for (int k = 0; k < model.nv(); ++k) w[k] = ws.sweeps.e[k] * sqrt(gains.D[k]);
}

// dw/dtheta (nv x 10 nv), dw/dr and dw/dtau = D^-1/2 (I - L) (nv x nv) at qdd (nv values), with e+
// left by innovations(); every entry is written. About 245 flops a pair of a joint and a link
// outboard of it.
template <class T, class V>
void innovation_jacobian(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
                         const V& qdd, const std::vector<T>& e_plus, InnovationJacobian<T>& ws,
                         RowMatrixRef<T> by_theta, RowMatrixRef<T> by_r, RowMatrixRef<T> by_tau) {
  using std::sqrt;
  constexpr int n = body_parameters;
  set_link_forces(model, kin, qdd, ws.forces);
  by_theta.setZero();
  by_r.setZero();
  by_tau.setZero();
  for (int k = 0; k < model.nv(); ++k) {
    const T root = T(1) / sqrt(gains.D[k]), half = e_plus[k] / T(2);
    const auto set_row = [&](int b) {  // dw(k) / dtheta(b)
      const Vector6<T> x = ws.s[b] + half * ws.h[b];
      by_theta.row(k).template segment<n>(n * b) =
          -root * (ws.forces.A[b].row(ws.h[b]) + bilinear<T>(ws.h[b], x));
    };
    ws.h[k] = Vector6<T>::Unit(model.joint(k).axis());
    ws.s[k].setZero();
    set_row(k);
    by_r(k, k) = -root * (qdd[k] + half);
    by_tau(k, k) = root;
    for (const int b : ws.subtrees.outboard(k)) {
      const int parent = model.parent(b), axis = model.joint(b).axis();
      Vector6<T>&h = ws.h[b], &s = ws.s[b];
      h = kin.phi[b].motion_from_parent(ws.h[parent]);
      s = kin.phi[b].motion_from_parent(ws.s[parent]);
      const T L = gains.g[b].dot(h), e = e_plus[b] - gains.g[b].dot(s);
      h[axis] -= L;
      s[axis] += e;
      set_row(b);
      by_r(k, b) = root * L * (qdd[b] + e - half * L);
      by_tau(k, b) = -root * L;
    }
  }
}

}  // namespace kalmarm
