// A rigid body from its inertia about the centre of mass.
#pragma once

#include <Eigen/Eigenvalues>

#include "algorithms/spatial/inertia.hpp"

namespace kalmarm {

// Moments in rising order; what rounding makes negative is left so.
inline RigidBody<double> with_principal_axes(double mass, const Vector3<double>& com,
                                             const Matrix3<double>& I_cm) {
  const Eigen::SelfAdjointEigenSolver<Matrix3<double>> eigen(I_cm);
  Matrix3<double> axes = eigen.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  return {mass, com, Eigen::Quaternion<double>(axes), eigen.eigenvalues()};
}

}  // namespace kalmarm
