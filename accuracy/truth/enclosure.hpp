// How far at most are given numbers from the true M, M^-1, D, g and accelerations of a mechanism?
// Its parameters, q, qd and tau are exact as they stand. What is given may come from anywhere: it
// is verified, not worked out again, and the answers are proven, rounding included.
//
// In balls (ball.hpp), at the digits in force, M and ID(a) = M a + bias of the world frame
// (world_mechanics.hpp) and the filter from below (filter_bounds.hpp), which proves
//   M >= diag(theta),   theta(k) = 1 / (2 nv x(k))                                         (1)
// for numbers x near the diagonal of M^-1: no positive semidefinite matrix is larger than nv times
// its diagonal, so that half of that bound leaves room for rounding. By (1), with the norm
// |r|_theta = sqrt(sum of r(k)^2 / theta(k)),
//   M^-1(k,k) <= 1 / theta(k),   sqrt(r'M^-1 r) <= |r|_theta                               (2)
//
// Of an acceleration a~, with r = tau - ID(a~) = M (a - a~):
//   sqrt((a - a~)'M (a - a~)) <= |r|_theta,   |a - a~|(k) <= |r|_theta / sqrt(theta(k))    (3)
// by Cauchy and Schwarz, and with (2). Of an inverse X, whose residual is R = 1 - M X:
//   |M^-1 - X|(i,j) = |M^-1 R|(i,j) <= |R e_j|_theta / sqrt(theta(i))                      (4)
// D and g lie in the balls of filter_bounds.hpp, M in its own.
//
// What cannot be proven at the digits in force has an infinite width.
#pragma once

#include <optional>

#include "accuracy/truth/filter_bounds.hpp"
#include "accuracy/truth/task.hpp"
#include "accuracy/truth/world_mechanics.hpp"

namespace kalmarm {

class Enclosure {
 public:
  // T: float or double. x, near the diagonal of M^-1: nv numbers.
  template <class T>
  Enclosure(const Model<T>& model, const VectorX<T>& q, const VectorX<Real>& x);
  Enclosure(const Enclosure&) = delete;
  Enclosure& operator=(const Enclosure&) = delete;

  // (1): M is positive definite. Otherwise all that needs its inverse has an infinite width.
  bool definite() const { return definite_; }

  // Centres of balls: M (nv x nv), and the torque that gives qdd.
  MatrixX<Real> mass() const;
  VectorX<Real> torque(const VectorX<Real>& qd, const VectorX<Real>& qdd,
                       const Vector3<Real>& gravity) const;

  // In the measures of measures.hpp: of A = M or X max |dA_ij| / sqrt(A_ii A_jj), of D and g
  // max |dD(k)| / D(k) and max |dg(k)| / |g(k)|.
  double mass_width(const MatrixX<Real>& M) const;
  double inverse_width(const MatrixX<Real>& X) const;
  double D_width(const VectorX<Real>& D) const;
  double g_width(const MatrixX<Real>& g) const;
  AccelerationWidth acceleration_width(const VectorX<Real>& qd, const VectorX<Real>& tau,
                                       const Vector3<Real>& gravity, const VectorX<Real>& a) const;

  // r of (3), which also corrects a, and the width by it.
  VectorX<Ball> residual(const VectorX<Real>& qd, const VectorX<Real>& tau,
                         const Vector3<Real>& gravity, const VectorX<Real>& a) const;
  AccelerationWidth acceleration_width(const VectorX<Ball>& residual, const VectorX<Real>& a) const;

 private:
  const MatrixX<Ball>& M() const;
  const std::optional<FactorBalls>& factors() const;
  Ball theta_norm(const VectorX<Ball>& r) const;

  Model<Ball> model_;
  LinkKinematics<Ball> kin_;
  WorldMechanics<Ball> world_;
  VectorX<Ball> theta_, root_;  // sqrt(1 / theta)
  bool definite_;
  mutable MatrixX<Ball> M_;  // worked out when it is first asked for, as the factors
  mutable std::optional<std::optional<FactorBalls>> factors_;
};

}  // namespace kalmarm
