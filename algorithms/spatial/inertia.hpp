// A rigid body's inertia: the parameters, and the two forms that the algorithms use.
//
//   parameters  m, c, and principal moments J = (J1, J2, J3) along axes E: I_cm = E diag(J) E'
//   covariance  M = [I_cm + m (c'c 1 - cc')  m c~; -m c~  m 1]
//   factored    M = W W',  W = [E diag(sqrt J)  sqrt(m) c~; 0  sqrt(m) 1]
//   weighted    M = V diag(w) V',  V = [E  c~; 0  1],  w = (J1, J2, J3, m, m, m)
// W and V come from the parameters: a Cholesky factorisation of M would fail for rods and points,
// and would lose I_cm beside m c'c.
#pragma once

#include <limits>

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

template <class T>
struct RigidBody {
  T mass = T(0);                                         // [kg]
  Vector3<T> com = Vector3<T>::Zero();                   // c, link frame [m]
  Eigen::Quaternion<T> axes = {T(1), T(0), T(0), T(0)};  // E, any length but zero
  Vector3<T> moments = Vector3<T>::Zero();               // J, about the com [kg m^2]

  bool massless() const { return mass == T(0) && moments.isZero(T(0)); }

  template <class U>
  RigidBody<U> cast() const {
    return {U(mass), com.template cast<U>(), axes.template cast<U>(), moments.template cast<U>()};
  }
};

// M(k) by its ten numbers about the link's origin. Sums of inertias about one point add up entry by
// entry.
template <class T>
struct SpatialInertia {
  T m = T(0);
  Vector3<T> h = Vector3<T>::Zero();  // m c
  Matrix3<T> I = Matrix3<T>::Zero();  // I_o

  SpatialInertia() = default;
  explicit SpatialInertia(const RigidBody<T>& body) : m(body.mass), h(body.mass * body.com) {
    const Matrix3<T> E = rotation(body.axes);
    I = E * body.moments.asDiagonal() * E.transpose();
    const Matrix3<T> hx = cross_matrix(h), cx = cross_matrix(body.com);
    I -= hx * cx;
    I.template triangularView<Eigen::StrictlyUpper>() = I.transpose();
  }

  SpatialInertia& operator+=(const SpatialInertia& other) {
    m += other.m;
    h += other.h;
    I += other.I;
    return *this;
  }

  // M x.
  Vector6<T> operator*(const Vector6<T>& x) const {
    const Vector3<T> w = x.template head<3>(), v = x.template tail<3>();
    Vector6<T> f;
    f << I * w + h.cross(v), m * v - h.cross(w);
    return f;
  }

  Matrix6<T> matrix() const {
    Matrix6<T> M = Matrix6<T>::Zero();
    M.template topLeftCorner<3, 3>() = I;
    M.template topRightCorner<3, 3>() = cross_matrix(h);
    M.template bottomLeftCorner<3, 3>() = -cross_matrix(h);
    M.template bottomRightCorner<3, 3>().diagonal().setConstant(m);
    return M;
  }

  // phi M phi' in ten numbers: h <- Rh + mp, I <- RIR' - p~(Rh)~ - (Rh + mp)~ p~.
  SpatialInertia to_parent(const Transform<T>& phi) const {
    SpatialInertia out;
    const Vector3<T> Rh = phi.R * h;
    out.m = m;
    out.h = Rh + m * phi.p;
    const Matrix3<T> px = cross_matrix(phi.p);
    out.I = phi.R * I * phi.R.transpose() - px * cross_matrix(Rh) - cross_matrix(out.h) * px;
    out.I.template triangularView<Eigen::StrictlyUpper>() = out.I.transpose();
    return out;
  }
};

// V diag(w) V' = M.
template <class T>
struct WeightedInertia {
  Matrix6<T> V = Matrix6<T>::Identity();
  Vector6<T> w = Vector6<T>::Zero();

  WeightedInertia() = default;
  explicit WeightedInertia(const RigidBody<T>& body) {
    V.template topLeftCorner<3, 3>() = rotation(body.axes);
    V.template topRightCorner<3, 3>() = cross_matrix(body.com);
    w << body.moments, body.mass, body.mass, body.mass;
  }

  // W = V diag(sqrt w).
  Matrix6<T> W() const { return V * w.cwiseSqrt().asDiagonal(); }
};

// All forms of one link's inertia.
template <class T>
struct LinkInertia {
  SpatialInertia<T> M;
  WeightedInertia<T> weighted;
  Matrix6<T> W = Matrix6<T>::Zero();
  Matrix3<T> I_cm = Matrix3<T>::Zero();
  bool massless = true;

  LinkInertia() = default;
  explicit LinkInertia(const RigidBody<T>& body)
      : M(body), weighted(body), W(weighted.W()), massless(body.massless()) {
    const auto E = weighted.V.template topLeftCorner<3, 3>();
    I_cm = E * body.moments.asDiagonal() * E.transpose();
  }

  // Of M alone, V and W NaN; com = h / m.
  LinkInertia(const SpatialInertia<T>& inertia, const Vector3<T>& com)
      : M(inertia), massless(false) {
    const T unknown(std::numeric_limits<double>::quiet_NaN());
    weighted.V.setConstant(unknown);
    weighted.w.setConstant(unknown);
    W.setConstant(unknown);
    I_cm = M.I + cross_matrix(M.h) * cross_matrix(com);
  }

  // Seen from another frame: phi M phi', phi W, phi V.
  LinkInertia seen_from(const Transform<T>& phi) const {
    LinkInertia out = *this;
    out.M = M.to_parent(phi);
    const Matrix6<T> X = phi.matrix();
    out.weighted.V = X * weighted.V;
    out.W = X * W;
    out.I_cm = phi.R * I_cm * phi.R.transpose();
    return out;
  }
};

}  // namespace kalmarm
