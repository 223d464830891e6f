// Inverse dynamics by Newton and Euler, in link frames, about every body's centre of mass.
//
//   a(k)   = phi'(k) a(parent) + H' q''(k) + c(k),   a(base) = -gravity        a = (alpha; a_o)
//   a_c    = a_o + alpha x c + w x v_c,   v_c = v_o + w x c                    v = (w; v_o)
//   f      = m a_c,   n = I_cm alpha + w x I_cm w
//   z(k)   = (n + c x f; f) + sum over children c of phi(k,c) z(c)             (1.1)
//   tau(k) = H(k) z(k) + r(k) q''(k)                                           (1.4)
// At q'' = 0 it is the bias torque H phi b of (2.1), gravity included. Without bias it is M q''.
// The force on a body is its mass times one acceleration: where a heavy body hardly moves, the
// terms of M(k) a(k) + b(k) about the origin would cancel. That makes it fit for the residual of an
// acceleration that is nearly right (refined.hpp).
#pragma once

#include <vector>

#include "algorithms/model/link_kinematics.hpp"

namespace kalmarm {

template <class T>
struct InverseDynamics {
  std::vector<Vector6<T>> a, z;

  explicit InverseDynamics(const Model<T>& model) : a(model.nv()), z(model.nv()) {}
};

namespace detail {

// z(k) of the link alone.
template <bool with_bias, class T>
Vector6<T> link_force(const Model<T>& model, const LinkKinematics<T>& kin, int k,
                      const Vector6<T>& a) {
  const LinkInertia<T>& inertia = model.inertia(k);
  const Vector3<T>& com = model.joint(k).body.com;
  const Vector3<T> alpha = a.template head<3>();
  Vector3<T> a_c = a.template tail<3>() + alpha.cross(com);
  Vector3<T> n = inertia.I_cm * alpha;
  if constexpr (with_bias) {
    const Vector3<T> w = kin.v[k].template head<3>();
    a_c += w.cross(Vector3<T>(kin.v[k].template tail<3>() + w.cross(com)));
    n += w.cross(Vector3<T>(inertia.I_cm * w));
  }
  const Vector3<T> f = inertia.M.m * a_c;
  Vector6<T> z;
  z << n + com.cross(f), f;
  return z;
}

// a(k) of the link from its parent's, already in a.
template <bool with_bias, class T>
void set_acceleration(const Model<T>& model, const LinkKinematics<T>& kin, int k, const T& qdd,
                      std::vector<Vector6<T>>& a) {
  const int parent = model.parent(k);
  if (parent >= 0)
    a[k] = kin.phi[k].motion_from_parent(a[parent]);
  else if constexpr (with_bias)
    a[k] = kin.phi[k].motion_from_parent(base_acceleration(model));
  else
    a[k].setZero();
  if constexpr (with_bias) a[k] += kin.c[k];
  a[k][model.joint(k).axis()] += qdd;
}

template <bool with_bias, class T, class A>
void newton_euler(const Model<T>& model, const LinkKinematics<T>& kin, const A& qdd,
                  InverseDynamics<T>& ws, Eigen::Ref<VectorX<T>> tau) {
  for (int k = 0; k < model.nv(); ++k) {
    set_acceleration<with_bias>(model, kin, k, T(qdd[k]), ws.a);
    ws.z[k] = link_force<with_bias>(model, kin, k, ws.a[k]);
  }
  for (int k = model.nv() - 1; k >= 0; --k) {
    tau[k] = ws.z[k][model.joint(k).axis()] + model.joint(k).r * qdd[k];
    if (const int parent = model.parent(k); parent >= 0)
      ws.z[parent] += kin.phi[k].force_to_parent(ws.z[k]);
  }
}

}  // namespace detail

// a(k) of every link from qdd (nv values), after set_position and set_velocity. About 40 flops a
// link.
template <class T, class A>
void link_accelerations(const Model<T>& model, const LinkKinematics<T>& kin, const A& qdd,
                        std::vector<Vector6<T>>& a) {
  for (int k = 0; k < model.nv(); ++k) detail::set_acceleration<true>(model, kin, k, T(qdd[k]), a);
}

// tau (nv values) from qdd (nv values), after set_position and set_velocity. About 180 flops a
// link.
template <class T, class A>
void inverse_dynamics(const Model<T>& model, const LinkKinematics<T>& kin, const A& qdd,
                      InverseDynamics<T>& ws, Eigen::Ref<VectorX<T>> tau) {
  detail::newton_euler<true>(model, kin, qdd, ws, tau);
}

// tau = M x (nv values), after set_position. About 130 flops a link.
template <class T, class A>
void mass_times(const Model<T>& model, const LinkKinematics<T>& kin, const A& x,
                InverseDynamics<T>& ws, Eigen::Ref<VectorX<T>> tau) {
  detail::newton_euler<false>(model, kin, x, ws, tau);
}

}  // namespace kalmarm
