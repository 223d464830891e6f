// Inverse dynamics by Newton and Euler, in link frames.
//
//   a(k)   = phi'(k) a(parent) + H' q''(k) + c(k),   a(base) = -gravity
//   z(k)   = M(k) a(k) + b(k) + sum over children c of phi(k,c) z(c)     (1.1), w(k) = M a + b
//   tau(k) = H(k) z(k) + r(k) q''(k)                                     (1.4)
// At q'' = 0 it is the bias torque H phi b of (2.1), gravity included.
#pragma once

#include <vector>

#include "algorithms/model/random_model.hpp"

namespace kalmarm {

template <class T>
struct InverseDynamics {
  std::vector<Vector6<T>> a, z;

  explicit InverseDynamics(const Model<T>& model) : a(model.nv()), z(model.nv()) {}
};

// tau (nv values) from qdd (nv values), after set_position and set_velocity. About 130 flops a
// link.
template <class T, class A>
void inverse_dynamics(const Model<T>& model, const RandomModel<T>& rm, const A& qdd,
                      InverseDynamics<T>& ws, Eigen::Ref<VectorX<T>> tau) {
  const Vector6<T> a0 = base_acceleration(model);
  for (int k = 0; k < model.nv(); ++k) {
    const int parent = model.parent(k);
    ws.a[k] = rm.phi[k].motion_from_parent(parent < 0 ? a0 : ws.a[parent]) + rm.c[k];
    ws.a[k][model.joint(k).axis()] += qdd[k];
    ws.z[k] = model.M(k) * ws.a[k] + rm.b[k];
  }
  for (int k = model.nv() - 1; k >= 0; --k) {
    tau[k] = ws.z[k][model.joint(k).axis()] + model.joint(k).r * qdd[k];
    if (const int parent = model.parent(k); parent >= 0)
      ws.z[parent] += rm.phi[k].force_to_parent(ws.z[k]);
  }
}

}  // namespace kalmarm
