// Spatial (6-D) vectors, transforms and inertias in link frames.
//
// A spatial force is (moment; force), a spatial motion (angular; linear), both 6x1 about the link's
// origin.
//   phi(p,k) = [R  p~R; 0  R]                 force of link k seen from its parent p     (paper, 1)
//   phi' x   = (R'w; R'(v - p x w))           motion of the parent seen from link k
//   M(k)     = [I_o  m c~; -m c~  m 1]        about the link's origin         (paper, 1, corrected)
//   I_o      = I_cm + m (c'c 1 - cc')
//   m x s    = (w x s_w; w x s_v + v x s_w)   motion cross motion
//   m x* f   = (w x n + v x f; w x f)         motion cross force
// R turns link coordinates into the parent's, p is the link's origin seen from the parent's.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <type_traits>

namespace kalmarm {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;
template <class T>
using Vector6 = Eigen::Matrix<T, 6, 1>;
template <class T>
using Matrix6 = Eigen::Matrix<T, 6, 6>;
template <class T>
using VectorX = Eigen::Matrix<T, Eigen::Dynamic, 1>;
template <class T>
using MatrixX = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;

// A measurement's row H: a unit row, as every joint's is in its link's frame, or any.
struct UnitRow {
  int axis;
};

// P H'.
template <class T>
Vector6<T> column(const Matrix6<T>& P, UnitRow H) {
  return P.col(H.axis);
}
template <class T>
Vector6<T> column(const Matrix6<T>& P, const Vector6<T>& H) {
  return P * H;
}

// H x.
template <class T>
T dot(UnitRow H, const Vector6<T>& x) {
  return x[H.axis];
}
template <class T>
T dot(const Vector6<T>& H, const Vector6<T>& x) {
  return H.dot(x);
}

// Unit roundoff u: 2^-53 for double.
template <class T>
T unit_roundoff() {
  return Eigen::NumTraits<T>::epsilon() / T(2);
}

// Of numbers that may be sums of two (pair.hpp): their high parts are to be what they round to.
template <class... T>
void normalise(T&...) {}

// The next wider precision; 64 bits for double on x86. Any other T is wide enough.
template <class T>
using Wider = std::conditional_t<std::is_same_v<T, float>, double,
                                 std::conditional_t<std::is_same_v<T, double>, long double, T>>;

// v~, so that v~ x = v x x.
template <class T>
Matrix3<T> cross_matrix(const Vector3<T>& v) {
  Matrix3<T> m;
  m << T(0), -v[2], v[1], v[2], T(0), -v[0], -v[1], v[0], T(0);
  return m;
}

// Rotation matrix of a quaternion, which need not have unit length: rounding its entries leaves an
// exact rotation. NaN where the square of its length is zero or overflows.
template <class T>
Matrix3<T> rotation(const Eigen::Quaternion<T>& q) {
  const T squares = q.squaredNorm();
  const T s = T(2) / squares + T(0) * squares;
  const T xx = s * q.x() * q.x(), yy = s * q.y() * q.y(), zz = s * q.z() * q.z();
  const T xy = s * q.x() * q.y(), xz = s * q.x() * q.z(), yz = s * q.y() * q.z();
  const T wx = s * q.w() * q.x(), wy = s * q.w() * q.y(), wz = s * q.w() * q.z();
  Matrix3<T> R;
  R << T(1) - (yy + zz), xy - wz, xz + wy,  //
      xy + wz, T(1) - (xx + zz), yz - wx,   //
      xz - wy, yz + wx, T(1) - (xx + yy);
  return R;
}

// phi(p,k).
template <class T>
struct Transform {
  Matrix3<T> R;
  Vector3<T> p;

  Matrix6<T> matrix() const {
    Matrix6<T> phi = Matrix6<T>::Zero();
    phi.template topLeftCorner<3, 3>() = R;
    phi.template topRightCorner<3, 3>() = cross_matrix(p) * R;
    phi.template bottomRightCorner<3, 3>() = R;
    return phi;
  }

  // phi x. 30 flops.
  Vector6<T> force_to_parent(const Vector6<T>& x) const {
    Vector6<T> y;
    y.template tail<3>() = R * x.template tail<3>();
    y.template head<3>() = R * x.template head<3>() + p.cross(Vector3<T>(y.template tail<3>()));
    return y;
  }

  // phi' x. 30 flops.
  Vector6<T> motion_from_parent(const Vector6<T>& x) const {
    const Vector3<T> w = x.template head<3>();
    Vector6<T> y;
    y.template head<3>() = R.transpose() * w;
    y.template tail<3>() = R.transpose() * (x.template tail<3>() - p.cross(w));
    return y;
  }

  // phi P phi' of a symmetric P = [A B; B' C]. With C1 = RCR', B1 = RBR', A1 = RAR':
  //   C <- C1,  B <- B1 + p~C1,  A <- A1 + p~B1' + B p~'.
  // The result is symmetric to the last bit: its lower triangle is a copy of the upper. About 250
  // flops.
  Matrix6<T> congruence(const Matrix6<T>& P) const {
    const Matrix3<T> C = R * P.template bottomRightCorner<3, 3>() * R.transpose();
    const Matrix3<T> B1 = R * P.template topRightCorner<3, 3>() * R.transpose();
    const Matrix3<T> A1 = R * P.template topLeftCorner<3, 3>() * R.transpose();
    const Matrix3<T> px = cross_matrix(p);
    const Matrix3<T> B = B1 + px * C;
    const Matrix3<T> A = A1 + px * B1.transpose() - B * px;
    Matrix6<T> out;
    out.template topLeftCorner<3, 3>() = A;
    out.template topRightCorner<3, 3>() = B;
    out.template bottomRightCorner<3, 3>() = C;
    out.template triangularView<Eigen::StrictlyLower>() = out.transpose();
    return out;
  }

  // phi' L phi of a symmetric L = [A B; B' C]. With B1 = B + A p~ and C1 = C + B'p~ - p~B1:
  //   A <- R'AR,  B <- R'B1 R,  C <- R'C1 R.      Symmetric to the last bit. About 250 flops.
  Matrix6<T> dual_congruence(const Matrix6<T>& L) const {
    const Matrix3<T> px = cross_matrix(p);
    const Matrix3<T> A = L.template topLeftCorner<3, 3>(), B = L.template topRightCorner<3, 3>();
    const Matrix3<T> B1 = B + A * px;
    const Matrix3<T> C1 = L.template bottomRightCorner<3, 3>() + B.transpose() * px - px * B1;
    Matrix6<T> out;
    out.template topLeftCorner<3, 3>() = R.transpose() * A * R;
    out.template topRightCorner<3, 3>() = R.transpose() * B1 * R;
    out.template bottomRightCorner<3, 3>() = R.transpose() * C1 * R;
    out.template triangularView<Eigen::StrictlyLower>() = out.transpose();
    return out;
  }
};

// m x s.
template <class T>
Vector6<T> cross_motion(const Vector6<T>& m, const Vector6<T>& s) {
  const Vector3<T> w = m.template head<3>(), v = m.template tail<3>();
  const Vector3<T> sw = s.template head<3>(), sv = s.template tail<3>();
  Vector6<T> out;
  out << w.cross(sw), w.cross(sv) + v.cross(sw);
  return out;
}

// m x* f.
template <class T>
Vector6<T> cross_force(const Vector6<T>& m, const Vector6<T>& f) {
  const Vector3<T> w = m.template head<3>(), v = m.template tail<3>();
  const Vector3<T> n = f.template head<3>(), l = f.template tail<3>();
  Vector6<T> out;
  out << w.cross(n) + v.cross(l), w.cross(l);
  return out;
}

}  // namespace kalmarm
