// Derivatives of a = M^-1 (tau - bias), forward dynamics, over theta, r and tau. Since
// tau = Y(q, q', a) theta + diag(r) a (regressor.hpp) and its derivative by a is M,
//
//   da = M^-1 (dtau - Y dtheta - diag(a) dr),   M^-1 = (I - L*) D^-1 (I - L)           (3.3)
// Row i of M^-1 Y, at link b's parameters, is y'A(b) with y the velocity of link b at joint
// velocities M^-1 e_i:
//   y(b) = phi'(b) y(parent) + H'(b) (M^-1)(b,i)
// so that Y itself is not formed.
#pragma once

#include <vector>

#include "algorithms/study/derivatives/regressor.hpp"
#include "algorithms/study/inverse_mass/sweeps.hpp"

namespace kalmarm {

template <class T>
struct AccelerationJacobian {
  LinkForces<T> forces;
  Sweeps<T> sweeps;
  MatrixX<T> X;  // M^-1
  std::vector<Vector6<T>> y;

  explicit AccelerationJacobian(const Model<T>& model)
      : forces(model), sweeps(model), X(model.nv(), model.nv()), y(model.nv()) {}
};

// da/dtheta (nv x 10 nv), da/dr and da/dtau (nv x nv) at the acceleration a (nv values) that the
// torque causes, from gains of the same state; every entry is written. About 160 flops a pair
// of joints.
template <class T, class V>
void acceleration_jacobian(const Model<T>& model, const LinkKinematics<T>& kin,
                           const Gains<T>& gains, const V& a, AccelerationJacobian<T>& ws,
                           RowMatrixRef<T> by_theta, RowMatrixRef<T> by_r, RowMatrixRef<T> by_tau) {
  constexpr int n = body_parameters;
  set_link_forces(model, kin, a, ws.forces);
  inverse_by_columns(model, kin, gains, ws.sweeps, ws.X);
  by_tau = ws.X;
  for (int i = 0; i < model.nv(); ++i)
    for (int b = 0; b < model.nv(); ++b) {
      const int parent = model.parent(b);
      Vector6<T>& y = ws.y[b];
      if (parent < 0)
        y.setZero();
      else
        y = kin.phi[b].motion_from_parent(ws.y[parent]);
      y[model.joint(b).axis()] += ws.X(b, i);
      by_theta.row(i).template segment<n>(n * b) = -ws.forces.A[b].row(y);
      by_r(i, b) = -ws.X(b, i) * a[b];
    }
}

}  // namespace kalmarm
