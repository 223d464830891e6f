// Mass matrix and bias torque in world axes about the world's origin, with ordinary 3-D vectors:
// the physics of algorithms/ by other formulas. It reads a model's parameters and shares no kernel
// with the library.
//
// Pose of link k: a quaternion Q of any length and the origin p; z is its joint's axis. Outwards,
// at qdd = 0 and a(base) = -gravity, with primes for the parent and d = p - p':
//   a = a' + al' x d + w' x (w' x d)
//   turning   w = w' + z qd,   al = al' + w0 x z qd                                        (1)
//   sliding   w = w',   al = al',   a <- a + 2 w' x z qd                                   (2)
// w0 is the angular velocity before the joint: all three turns of a ball share it. Link k alone,
// with its com at r = p + c:
//   f = m (a + al x c + w x (w x c)),   n = I al + w x I w + r x f                         (3)
// and with F and N their sums over all links outboard of joint k:
//   bias(k) = z'(N - p x F) or z'F                                                         (4)
// A unit rate of joint j moves its outboard side with (w, v) = (z, -z x p) or (0, z), v at the
// world's origin. With m, h = sum of m r and J = sum of I + m (r'r 1 - rr') of that side, its
// momentum is
//   l = m v + w x h,   L = J w + h x v
// and, for every i inboard of j and for i = j,
//   M(i,j) = w(i)'L + v(i)'l                                                               (5)
#pragma once

#include "accuracy/real.hpp"
#include "algorithms/model/model.hpp"

namespace kalmarm {

struct WorldFrame {
  MatrixX<Real> M;     // nv x nv, both triangles, armature included
  VectorX<Real> bias;  // nv, gravity included
};

// At the precision in force, in which the model must have been cast.
WorldFrame world_frame(const Model<Real>& model, const VectorX<Real>& q, const VectorX<Real>& qd);

}  // namespace kalmarm
