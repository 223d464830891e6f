// The spatially random model of a robot in one state: what the filters run on.
//
//   z-(k)  = sum over children c of phi(k,c) z+(c) + w(k)      (1.1), summed for a tree
//   tau(k) = H(k) z(k) + noise of covariance r(k)              (1.4), with joint noise
//   E w(k) = b(k),  cov w(k) = M(k)                            (1.3)
// q gives phi(k) = phi(parent(k), k); M and H are constant in link frames (model.hpp). q' gives
//   v(k) = phi'(k) v(parent) + H' q'(k)                        link velocity
//   c(k) = u(k) x H' q'(k)                                     its acceleration at q'' = 0
//   b(k) = v(k) x* M(k) v(k)                                   bias force of the link alone
// u(k) is the velocity of the link before the joint's own motion, in link k's axes. For one-DoF
// joints it may as well be v(k); the three turns of a ball joint share the u of the first, since
// their axes turn with the body. c stays apart from b, and gravity is the acceleration -gravity of
// the base: carried along the links instead of being summed up as joint torques, neither loses
// accuracy with the robot's length.
#pragma once

#include <vector>

#include "algorithms/model/model.hpp"
#include "algorithms/spatial/sincos.hpp"

namespace kalmarm {

template <class T>
struct LinkKinematics {
  std::vector<Transform<T>> phi;
  std::vector<Vector6<T>> v, c, b;
  VectorX<T> q, qd;  // the state that it is of

  explicit LinkKinematics(const Model<T>& model)
      : phi(model.nv()),
        v(model.nv(), Vector6<T>::Zero()),
        c(model.nv(), Vector6<T>::Zero()),
        b(model.nv(), Vector6<T>::Zero()),
        q(model.nq()),
        qd(VectorX<T>::Zero(model.nv())) {}
};

// phi of every link from q (nq values; quaternions of any length but zero). One sine and cosine and
// 20 flops a hinge.
template <class T, class Q>
void set_position(const Model<T>& model, const Q& q, LinkKinematics<T>& kin) {
  const auto turned = [](const Matrix3<T>& R) {  // R C
    Matrix3<T> out;
    out << R.col(1), R.col(2), R.col(0);
    return out;
  };
  for (int i = 0; i < model.nq(); ++i) kin.q[i] = q[i];
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<T>& joint = model.joint(k);
    const Matrix3<T>& E = model.E(k);
    Transform<T>& phi = kin.phi[k];
    phi.R = E;
    phi.p = joint.translation;
    switch (joint.coordinate) {
      case Coordinate::angle: {
        T s, c;
        sin_cos(T(q[joint.q_index]), T(-joint.ref), s, c);
        phi.R.col(0) = c * E.col(0) + s * E.col(1);
        phi.R.col(1) = c * E.col(1) - s * E.col(0);
        break;
      }
      case Coordinate::distance:
        phi.p += (q[joint.q_index] - joint.ref) * E.col(2);
        break;
      case Coordinate::quaternion: {
        const int i = joint.q_index;
        phi.R = turned(E * rotation(Eigen::Quaternion<T>(q[i], q[i + 1], q[i + 2], q[i + 3])));
        break;
      }
      case Coordinate::position: {
        const int i = joint.q_index;
        phi.R = turned(E);
        phi.p += E * Vector3<T>(q[i], q[i + 1], q[i + 2]);
        break;
      }
      case Coordinate::follower:
        phi.R << T(0), T(0), T(1), T(1), T(0), T(0), T(0), T(1), T(0);
        phi.p.setZero();
        break;
    }
  }
}

// v, c and b of every link from qd (nv values), after set_position. About 110 flops a link.
template <class T, class V>
void set_velocity(const Model<T>& model, const V& qd, LinkKinematics<T>& kin) {
  for (int k = 0; k < model.nv(); ++k) kin.qd[k] = qd[k];
  Vector6<T> u;  // of the joint that the current DoF belongs to
  for (int k = 0; k < model.nv(); ++k) {
    const int parent = model.parent(k), axis = model.joint(k).axis();
    const Transform<T>& phi = kin.phi[k];
    const Vector6<T> inboard =
        parent < 0 ? Vector6<T>(Vector6<T>::Zero()) : phi.motion_from_parent(kin.v[parent]);
    u = model.joint(k).coordinate == Coordinate::follower ? phi.motion_from_parent(u) : inboard;
    kin.v[k] = inboard;
    kin.v[k][axis] += qd[k];
    Vector6<T> joint_velocity = Vector6<T>::Zero();
    joint_velocity[axis] = qd[k];
    kin.c[k] = cross_motion(u, joint_velocity);
    kin.b[k] = cross_force(kin.v[k], Vector6<T>(model.M(k) * kin.v[k]));
  }
}

// Acceleration of the base that stands for gravity: (0; -gravity).
template <class T>
Vector6<T> base_acceleration(const Model<T>& model) {
  Vector6<T> a0;
  a0 << Vector3<T>::Zero(), -model.gravity();
  return a0;
}

}  // namespace kalmarm
