// A frame on a link: where a motion is asked for, or where a force acts.
//
// Its velocity, in its own axes and of its own origin, is (angular; linear) = J qd, so that
// J M^-1 J' is what a force and moment there accelerate it by: the inverse of the operational-space
// inertia. J' takes a moment and force at the site to joint torques: for k from its link inward
//   x <- phi x,  J'(k) = H(k) x            phi of the site, then of every link (1.1)
#pragma once

#include <vector>

#include "algorithms/model/link_kinematics.hpp"

namespace kalmarm {

template <class T>
struct Site {
  int link = -1;                                             // -1: the fixed base
  Eigen::Quaternion<T> rotation = {T(1), T(0), T(0), T(0)};  // its axes in the link's, any length
  Vector3<T> translation = Vector3<T>::Zero();               // its origin in the link's frame [m]

  Transform<T> phi() const { return {kalmarm::rotation(rotation), translation}; }

  template <class U>
  Site<U> cast() const {
    return {link, rotation.template cast<U>(), translation.template cast<U>()};
  }
};

// J (6 rows a site x nv) after set_position. About 260 flops a site and link inboard of it.
template <class T>
void site_jacobian(const Model<T>& model, const LinkKinematics<T>& kin,
                   const std::vector<Site<T>>& sites, Eigen::Ref<MatrixX<T>> J) {
  J.setZero();
  for (int i = 0; i < static_cast<int>(sites.size()); ++i) {
    const Transform<T> phi = sites[i].phi();
    for (int row = 0; row < 6; ++row) {
      Vector6<T> x = phi.force_to_parent(Vector6<T>(Vector6<T>::Unit(row)));
      for (int k = sites[i].link; k >= 0; k = model.parent(k)) {
        J(6 * i + row, k) = x[model.joint(k).axis()];
        x = kin.phi[k].force_to_parent(x);
      }
    }
  }
}

}  // namespace kalmarm
