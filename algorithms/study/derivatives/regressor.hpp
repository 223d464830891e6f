// The regressor of inverse dynamics: ID(q, q', q'') = Y(q, q', q'') theta + diag(r) q''.
//
//   z(b)  = A(b) theta(b)                       force of link b alone      (inertial_rows.hpp)
//   Y(k, columns of b) = H(k) phi(k,b) A(b)     b = k or outboard of it          (1.1), (1.4)
// which is y'A(b) with y = phi'(k,b) H'(k), the velocity of link b where only joint k moves:
//   y(k) = H'(k),   y(c) = phi'(c) y(parent of c)
// All other entries are zero. Link b's parameters are columns 10 b … 10 b + 9.
#pragma once

#include <vector>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/study/derivatives/inertial_rows.hpp"
#include "algorithms/study/derivatives/subtrees.hpp"

namespace kalmarm {

// A of every link at accelerations qdd.
template <class T>
struct LinkForces {
  std::vector<Vector6<T>> a;
  std::vector<InertialForce<T>> A;

  explicit LinkForces(const Model<T>& model) : a(model.nv()), A(model.nv()) {}
};

template <class T>
struct Regressor {
  Subtrees subtrees;
  LinkForces<T> forces;
  std::vector<Vector6<T>> y;

  explicit Regressor(const Model<T>& model) : subtrees(model), forces(model), y(model.nv()) {}
};

// After set_position and set_velocity. About 90 flops a link.
template <class T, class V>
void set_link_forces(const Model<T>& model, const LinkKinematics<T>& kin, const V& qdd,
                     LinkForces<T>& ws) {
  link_accelerations(model, kin, qdd, ws.a);
  for (int k = 0; k < model.nv(); ++k) ws.A[k] = InertialForce<T>(ws.a[k], kin.v[k]);
}

// Y (nv x 10 nv; every entry is written) at qdd (nv values), after set_position and set_velocity.
// [Nm or N per unit of theta.] 105 flops a pair of a joint and a link outboard of it.
template <class T, class V>
void regressor(const Model<T>& model, const LinkKinematics<T>& kin, const V& qdd, Regressor<T>& ws,
               RowMatrixRef<T> Y) {
  constexpr int n = body_parameters;
  set_link_forces(model, kin, qdd, ws.forces);
  Y.setZero();
  for (int k = 0; k < model.nv(); ++k) {
    ws.y[k] = Vector6<T>::Unit(model.joint(k).axis());
    Y.row(k).template segment<n>(n * k) = ws.forces.A[k].row(ws.y[k]);
    for (const int b : ws.subtrees.outboard(k)) {
      ws.y[b] = kin.phi[b].motion_from_parent(ws.y[model.parent(b)]);
      Y.row(k).template segment<n>(n * b) = ws.forces.A[b].row(ws.y[b]);
    }
  }
}

}  // namespace kalmarm
