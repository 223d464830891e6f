// Contacts with the world in the place of inertia: H = M + J'DJ, what contact simulators factor.
//
// A contact that resists the motion of link k along a line with stiffness d (of a step: h^2 times a
// spring's, h times a damper's, or an impulse's weight) is a term of the process noise Q:
//   J = e' J(k),   e = (p x f; f),      p: the point, f: the unit direction, in link k's frame    (C1)
//   M(k) <- M(k) + d e e'                                                                         (C2)
// and nothing else changes: the filter of (3.6) and (3.10) factors H, log det H = sum log D(k), and
// H is never formed. How a covariance update carries the term decides what is left of the digits
// beside it (docs/contacts.md).
#pragma once

#include "algorithms/model/link_kinematics.hpp"

namespace kalmarm {

template <class T>
struct ContactRow {
  int link = 0;
  Vector6<T> e = Vector6<T>::Zero();  // (moment; force) about the link's origin
  T d = T(0);                         // >= 0

  template <class U>
  ContactRow<U> cast() const {
    return {link, e.template cast<U>(), U(d)};
  }
};

// J of a contact: its entries on the path from the link to the base, zero elsewhere. J: nv. 36 flops
// a joint of the path.
template <class T>
void contact_jacobian(const Model<T>& model, const LinkKinematics<T>& kin, const ContactRow<T>& row,
                      VectorX<T>& J) {
  J.setZero();
  Vector6<T> e = row.e;
  for (int k = row.link; k >= 0; k = model.parent(k)) {
    J[k] = e[model.joint(k).axis()];
    if (model.parent(k) >= 0) e = kin.phi[k].force_to_parent(e);
  }
}

}  // namespace kalmarm
