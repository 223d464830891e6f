// The ten inertial parameters of a body, and coordinates in which each of them is physical.
//
//   theta = (m, h = m c (3), I_o = (Ixx, Iyy, Izz, Ixy, Ixz, Iyz))        in which M(k) is linear
//   pseudo-inertia   J = [Sigma h; h' m],  Sigma = 1/2 tr(I_o) 1 - I_o = integral of r r' dm
// A body is physical where J is positive definite: positive mass, positive moments that satisfy the
// triangle inequality. Rucker and Wensing (IEEE RA-L 2022) take the logarithm of its Cholesky
// factor for coordinates:
//   J = U U',   U = e^alpha [S t; 0 1],   S = [e^d1 s12 s13; 0 e^d2 s23; 0 0 e^d3]
// so that, with no bounds on any of them,
//   m = e^(2 alpha),   h = m t,   Sigma = m (S S' + t t')
//   x = (alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3)
// t is the centre of mass [m], the diagonal of S radii of gyration [m] along the axes.
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include "algorithms/spatial/inertia.hpp"

namespace kalmarm {

inline constexpr int body_parameters = 10;

template <class T>
using InertialVector = Eigen::Matrix<T, body_parameters, 1>;
template <class T>
using InertialMatrix = Eigen::Matrix<T, body_parameters, body_parameters>;

inline constexpr std::array<const char*, body_parameters> inertial_names{
    "m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};

template <class T>
InertialVector<T> inertial_parameters(const SpatialInertia<T>& M) {
  InertialVector<T> theta;
  theta << M.m, M.h, M.I(0, 0), M.I(1, 1), M.I(2, 2), M.I(0, 1), M.I(0, 2), M.I(1, 2);
  return theta;
}

template <class T>
SpatialInertia<T> spatial_inertia(const InertialVector<T>& theta) {
  SpatialInertia<T> M;
  M.m = theta[0];
  M.h = theta.template segment<3>(1);
  M.I << theta[4], theta[7], theta[8], theta[7], theta[5], theta[9], theta[8], theta[9], theta[6];
  return M;
}

template <class T>
Eigen::Matrix<T, 4, 4> pseudo_inertia(const SpatialInertia<T>& M) {
  Eigen::Matrix<T, 4, 4> J;
  J << Matrix3<T>(M.I.trace() / T(2) * Matrix3<T>::Identity() - M.I), M.h, M.h.transpose(), M.m;
  return J;
}

// theta of x. 60 flops and four exponentials.
template <class T>
InertialVector<T> from_log_cholesky(const InertialVector<T>& x) {
  using std::exp;
  const T m = exp(T(2) * x[0]);
  Matrix3<T> S;
  S << exp(x[1]), x[4], x[6], T(0), exp(x[2]), x[5], T(0), T(0), exp(x[3]);
  const Vector3<T> t = x.template tail<3>();
  const Matrix3<T> Sigma = m * (S * S.transpose() + t * t.transpose());
  SpatialInertia<T> M;
  M.m = m;
  M.h = m * t;
  M.I = Sigma.trace() * Matrix3<T>::Identity() - Sigma;
  return inertial_parameters(M);
}

// d theta / d x (10 x 10) at x: each column is the theta of
//   dm = 2 m dalpha,  dh = 2 h dalpha + m dt,
//   dSigma = 2 Sigma dalpha + m (dS S' + S dS' + dt t' + t dt')
template <class T>
InertialMatrix<T> log_cholesky_jacobian(const InertialVector<T>& x) {
  using std::exp;
  InertialMatrix<T> out;
  const InertialVector<T> theta = from_log_cholesky(x);
  const T m = theta[0];
  Matrix3<T> S;
  S << exp(x[1]), x[4], x[6], T(0), exp(x[2]), x[5], T(0), T(0), exp(x[3]);
  const Vector3<T> t = x.template tail<3>();
  const auto column = [&](const Vector3<T>& dh, const Matrix3<T>& half) {  // half + half' = dSigma
    const Matrix3<T> dSigma = half + half.transpose();
    SpatialInertia<T> dM;
    dM.h = dh;
    dM.I = dSigma.trace() * Matrix3<T>::Identity() - dSigma;
    return inertial_parameters(dM);
  };
  out.col(0) = T(2) * theta;
  constexpr std::array<std::pair<int, int>, 6> entries{
      {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};
  for (int k = 0; k < 6; ++k) {
    const auto [i, j] = entries[k];
    Matrix3<T> half = Matrix3<T>::Zero();
    half.row(i) = (i == j ? m * S(i, i) : m) * S.col(j).transpose();
    out.col(1 + k) = column(Vector3<T>::Zero(), half);
  }
  for (int i = 0; i < 3; ++i) {
    Matrix3<T> half = Matrix3<T>::Zero();
    half.row(i) = m * t.transpose();
    out.col(7 + i) = column(m * Vector3<T>::Unit(i), half);
  }
  return out;
}

// x of a body; NaN in it where the pseudo-inertia is not positive definite.
template <class T>
InertialVector<T> to_log_cholesky(const SpatialInertia<T>& M) {
  using std::log;
  using std::sqrt;
  const Vector3<T> t = M.h / M.m;
  const Eigen::Matrix<T, 4, 4> J = pseudo_inertia(M);
  const Matrix3<T> A = J.template topLeftCorner<3, 3>() / M.m - t * t.transpose();  // S S'
  const T s33 = sqrt(A(2, 2)), s13 = A(0, 2) / s33, s23 = A(1, 2) / s33;
  const T s22 = sqrt(A(1, 1) - s23 * s23), s12 = (A(0, 1) - s13 * s23) / s22;
  const T s11 = sqrt(A(0, 0) - s12 * s12 - s13 * s13);
  InertialVector<T> x;
  x << log(M.m) / T(2), log(s11), log(s22), log(s33), s12, s23, s13, t;
  return x;
}

}  // namespace kalmarm
