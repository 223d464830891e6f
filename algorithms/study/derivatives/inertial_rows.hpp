// Rows over a body's ten inertial parameters theta (inertial_parameters.hpp): what a virtual
// velocity y = (p; q) of the body, a spatial motion in its link's frame, does with its force.
//
//   y' M x = bilinear(y, x) theta,   x = (w; u):
//     m: q.u,   h: u x p - w x q,   Ixx: p_x w_x …,   Ixy: p_x w_y + p_y w_x …
// The force of a body with acceleration a = (alpha; a_o) and velocity v = (w; v_o) is linear too:
//   f = M a + v x* M v = A theta,   A = [0  -s~  N; s  B  0]                 (6 x 10)
//     s = a_o + w x v_o,   B = alpha~ + w~ w~,   N J = J alpha + w x J w for the six of J = I_o
// since the moment of h is h x a_o + w x (h x v_o) + v_o x (w x h) = h x s. A sum over bodies of
// y'A theta is the power of their forces: with y the link velocities at joint velocities x it is
// x' ID.
#pragma once

#include <type_traits>

#include "algorithms/study/derivatives/inertial_parameters.hpp"

namespace kalmarm {

// Jacobians are stored row by row. Functions take views of them, so that they may be parts of
// larger ones, and deduce T from their other arguments.
template <class T>
using RowMatrixX = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
template <class T>
using RowMatrixRef = std::type_identity_t<Eigen::Ref<RowMatrixX<T>>>;
template <class T>
using VectorRef = std::type_identity_t<Eigen::Ref<VectorX<T>>>;

// The gradient of y' M x over theta; symmetric in y and x. 38 flops.
template <class T>
InertialVector<T> bilinear(const Vector6<T>& y, const Vector6<T>& x) {
  const Vector3<T> p = y.template head<3>(), q = y.template tail<3>();
  const Vector3<T> w = x.template head<3>(), u = x.template tail<3>();
  InertialVector<T> out;
  out << q.dot(u), u.cross(p) - w.cross(q),   //
      p[0] * w[0], p[1] * w[1], p[2] * w[2],  //
      p[0] * w[1] + p[1] * w[0], p[0] * w[2] + p[2] * w[0], p[1] * w[2] + p[2] * w[1];
  return out;
}

// A of one body, by its entries that are not zero.
template <class T>
struct InertialForce {
  Vector3<T> s;
  Matrix3<T> B;
  Eigen::Matrix<T, 3, 6> N;

  InertialForce() = default;
  InertialForce(const Vector6<T>& a, const Vector6<T>& v) {
    const Vector3<T> w = v.template head<3>(), alpha = a.template head<3>();
    s = a.template tail<3>() + w.cross(Vector3<T>(v.template tail<3>()));
    const Matrix3<T> ww = w * w.transpose();
    B = cross_matrix(alpha) + ww;
    B.diagonal().array() -= ww.trace();
    const T xy = ww(0, 1), xz = ww(0, 2), yz = ww(1, 2);
    N << alpha[0], -yz, yz, alpha[1] - xz, alpha[2] + xy, ww(1, 1) - ww(2, 2),  //
        xz, alpha[1], -xz, alpha[0] + yz, ww(2, 2) - ww(0, 0), alpha[2] - xy,   //
        -xy, xy, alpha[2], ww(0, 0) - ww(1, 1), alpha[0] - yz, alpha[1] + xz;
  }

  // y' A. 62 flops.
  InertialVector<T> row(const Vector6<T>& y) const {
    const Vector3<T> p = y.template head<3>(), q = y.template tail<3>();
    InertialVector<T> out;
    out[0] = q.dot(s);
    out.template segment<3>(1) = s.cross(p) + B.transpose() * q;
    out.template tail<6>() = N.transpose() * p;
    return out;
  }
};

}  // namespace kalmarm
