// Mass matrix and bias torque in world axes about the world's origin, with ordinary 3-D vectors:
// the physics of algorithms/ by other formulas. It reads a model's parameters and shares no kernel
// with the library. The tests of algorithms/ have a third way, by Jacobians
// (algorithms/test/dense_mechanics.hpp): O(nv^3), closest to the definitions, in a fixed number of
// digits. This one forms no Jacobian and takes any number of digits, for truths of long robots.
//
// Pose of link k: a quaternion Q of any length and the origin p; z is its joint's axis. Outwards,
// with a(base) = -gravity, primes for the parent and d = p - p':
//   a = a' + al' x d + w' x (w' x d)
//   turning   w = w' + z qd,   al = al' + w0 x z qd + z qdd                                (1)
//   sliding   w = w',   al = al',   a <- a + 2 w' x z qd + z qdd                           (2)
// w0 is the angular velocity before the joint: all three turns of a ball share it. Link k alone,
// with its com at r = p + c:
//   f = m (a + al x c + w x (w x c)),   n = I al + w x I w + r x f                         (3)
// and with F and N their sums over all links outboard of joint k:
//   tau(k) = z'(N - p x F) + r(k) qdd   or   z'F + r(k) qdd                                (4)
// which at qdd = 0 is the bias torque. O(N); M is not formed.
//
// A unit rate of joint j moves its outboard side with (w, v) = (z, -z x p) or (0, z), v at the
// world's origin. With m, h = sum of m r and J = sum of I + m (r'r 1 - rr') of that side, its
// momentum is
//   l = m v + w x h,   L = J w + h x v
// and, for every i inboard of j and for i = j,
//   M(i,j) = w(i)'L + v(i)'l                                                               (5)
#pragma once

#include <vector>

#include "accuracy/real.hpp"
#include "algorithms/model/model.hpp"

namespace kalmarm {

// At the precision in force, in which the model must have been cast; the model must outlive it.
class WorldMechanics {
 public:
  WorldMechanics(const Model<Real>& model, const VectorX<Real>& q);

  // nv x nv, both triangles, armature included.
  MatrixX<Real> mass() const;

  // Inverse dynamics: the torque that gives qdd.
  VectorX<Real> torque(const VectorX<Real>& qd, const VectorX<Real>& qdd,
                       const Vector3<Real>& gravity) const;

 private:
  struct Pose {
    Eigen::Quaternion<Real> Q{Real(1), Real(0), Real(0), Real(0)};
    Vector3<Real> p = Vector3<Real>::Zero(), z = Vector3<Real>::Zero(), c = Vector3<Real>::Zero();
    Matrix3<Real> I = Matrix3<Real>::Zero();
  };

  // (w, v) of a unit rate of joint k
  Vector3<Real> turn(int k) const;
  Vector3<Real> shift(int k) const;

  const Model<Real>& model_;
  std::vector<Pose> poses_;
};

}  // namespace kalmarm
