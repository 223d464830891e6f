// Rigid bodies from inertias that are given in other ways, and from other rigid bodies.
#pragma once

#include <Eigen/Eigenvalues>

#include "algorithms/spatial/inertia.hpp"

namespace kalmarm {

// Moments in rising order; what rounding makes negative is left so.
template <class T>
RigidBody<T> with_principal_axes(const T& mass, const Vector3<T>& com, const Matrix3<T>& I_cm) {
  const Eigen::SelfAdjointEigenSolver<Matrix3<T>> eigen(I_cm);
  Matrix3<T> axes = eigen.eigenvectors();
  if (axes.determinant() < T(0)) axes.col(0) = -axes.col(0);
  return {mass, com, Eigen::Quaternion<T>(axes), eigen.eigenvalues()};
}

// Two rigid bodies on one link become one; either may be an inertia without mass.
template <class T>
RigidBody<T> welded(const RigidBody<T>& a, const RigidBody<T>& b) {
  if (a.massless()) return b;
  if (b.massless()) return a;
  const T mass = a.mass + b.mass;
  const Vector3<T> com = mass > T(0) ? Vector3<T>((a.mass * a.com + b.mass * b.com) / mass) : a.com;
  Matrix3<T> I = Matrix3<T>::Zero();
  for (const RigidBody<T>* body : {&a, &b}) {
    const Matrix3<T> E = rotation(body->axes), d = cross_matrix<T>(body->com - com);
    I += E * body->moments.asDiagonal() * E.transpose() - body->mass * d * d;
  }
  RigidBody<T> out = with_principal_axes(mass, com, I);
  out.moments = out.moments.cwiseMax(T(0));
  return out;
}

}  // namespace kalmarm
