// How large the terms are that a joint's inertia is summed from, before they cancel: for the
// question whether a computed D(k) is more than rounding.
//
//   J(k) = J_body + sum over children c of (sqrt J(c) + |p| sqrt m(c))^2,    p: origin of c from k
// bounds the polar moment of the whole outboard side about the joint's origin (Cauchy and Schwarz),
// and no term of it cancels: a point on the joint's axis that is reached by a detour still counts
// with the length of the detour. For a sliding joint the size is the outboard mass. 10 flops and a
// square root a link.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/model/link_kinematics.hpp"

namespace kalmarm {

template <class T>
struct PolarMoment {
  T m = T(0), J = T(0);

  PolarMoment() = default;
  explicit PolarMoment(const SpatialInertia<T>& M) : m(M.m), J(M.I.trace() / T(2)) {}

  void add_child(const PolarMoment& child, const Vector3<T>& p) {
    using std::sqrt;
    const T mpp = child.m * p.squaredNorm();
    m += child.m;
    J += child.J + mpp + T(2) * sqrt(child.J * mpp);
  }

  T size(const Joint<T>& joint) const { return (joint.slides ? m : J) + joint.r; }
};

template <class T>
std::vector<PolarMoment<T>> body_polar_moments(const Model<T>& model) {
  std::vector<PolarMoment<T>> out;
  out.reserve(model.nv());
  for (int k = 0; k < model.nv(); ++k) out.emplace_back(model.M(k));
  return out;
}

}  // namespace kalmarm
