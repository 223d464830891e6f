// Positions beside a position, for differences in multi-precision.
#pragma once

#include "accuracy/measures/real.hpp"
#include "algorithms/model/model.hpp"

namespace kalmarm {

// q moved by h along the velocity of DoF k.
inline VectorX<Real> displaced(const Model<Real>& model, VectorX<Real> q, int k, const Real& h) {
  int first = k;
  while (model.joint(first).coordinate == Coordinate::follower) --first;
  const int i = model.joint(first).q_index;
  if (model.joint(first).coordinate != Coordinate::quaternion) {
    q[i + k - first] += h;
    return q;
  }
  const Real half = h / 2;
  Eigen::Quaternion<Real> turn(cos(half), Real(0), Real(0), Real(0));
  turn.vec()[k - first] = sin(half);
  const Eigen::Quaternion<Real> turned =
      Eigen::Quaternion<Real>(q[i], q[i + 1], q[i + 2], q[i + 3]) * turn;
  q.segment<4>(i) << turned.w(), turned.x(), turned.y(), turned.z();
  return q;
}

}  // namespace kalmarm
