// Mass matrix and bias torque in world axes about the world's origin, with ordinary 3-D vectors:
// the physics of algorithms/ by other formulas. It reads a model's parameters and shares no kernel
// with the library. The tests of algorithms/ have a third way, by Jacobians
// (algorithms/test/dense_mechanics.hpp): O(nv^3), closest to the definitions, in a fixed number of
// digits. This one forms no Jacobian and takes any number of digits, for truths of long robots, and
// balls, for what is proven of them (enclosure.hpp).
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
//
// In balls: all of (1) to (5) are sums over links, whose radii add up. Orientations are products,
// Q = Q' q, whose radii would grow by a factor a link. Lengths of quaternions multiply, though, so
// that an exact quaternion C with |Q - C| <= s |C| is carried instead:
//   Q = Q' q:   C = centre of C' q,   d = |C' q - C| / |C|,   s = s' (1 + d) + d           (6)
// and Q is C, every entry widened by s |C|.
#pragma once

#include <vector>

#include "accuracy/truth/ball.hpp"
#include "algorithms/model/model.hpp"

namespace kalmarm {

// Of a link in the world: Q, of any length.
template <class S>
struct Orientation {
  Eigen::Quaternion<S> Q{S(1), S(0), S(0), S(0)};

  Orientation turned(const Eigen::Quaternion<S>& q) const { return {Q * q}; }
};

// (6)
template <>
struct Orientation<Ball> {
  Eigen::Quaternion<Ball> Q{Ball(1), Ball(0), Ball(0), Ball(0)}, C = Q;
  Ball s = 0;

  Orientation turned(const Eigen::Quaternion<Ball>& q) const;
};

// At the precision in force, in which the model must have been cast; the model must outlive it.
// S: Real or Ball.
template <class S>
class WorldMechanics {
 public:
  WorldMechanics(const Model<S>& model, const VectorX<S>& q);

  // nv x nv, both triangles, armature included.
  MatrixX<S> mass() const;

  // Inverse dynamics: the torque that gives qdd.
  VectorX<S> torque(const VectorX<S>& qd, const VectorX<S>& qdd, const Vector3<S>& gravity) const;

 private:
  struct Pose {
    Orientation<S> orientation;
    Vector3<S> p = Vector3<S>::Zero(), z = Vector3<S>::Zero(), c = Vector3<S>::Zero();
    Matrix3<S> I = Matrix3<S>::Zero();
  };

  // (w, v) of a unit rate of joint k
  Vector3<S> turn(int k) const;
  Vector3<S> shift(int k) const;

  const Model<S>& model_;
  std::vector<Pose> poses_;
};

extern template class WorldMechanics<Real>;
extern template class WorldMechanics<Ball>;

}  // namespace kalmarm
