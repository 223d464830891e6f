// The mass matrix by composite inertias (CRBA): Result 3.1, R = r + Phi r + r Phi*, seen through H.
//
//   r-(k)  = M(k) + sum over children c of phi(k,c) r-(c) phi'(k,c)      (3.5)
//   M(k,k) = H r-(k) H' + r(k)                                           (5.1), diagonal
//   M(m,k) = H(m) phi(m,k) r-(k) H'(k)   for every m inboard of k        (3.4), (5.1)
// Entries of joints on different branches are zero. r-(k) is the composite rigid-body inertia; it
// has the ten numbers of a body, so the recursion costs about 100 flops a link, and each entry off
// the diagonal 30.
#pragma once

#include <vector>

#include "algorithms/model/link_kinematics.hpp"

namespace kalmarm {

template <class T>
struct CompositeInertia {
  std::vector<SpatialInertia<T>> r_minus;

  explicit CompositeInertia(const Model<T>& model) : r_minus(model.nv()) {}
};

// r-(k) of every link.
template <class T>
void set_composite_inertia(const Model<T>& model, const LinkKinematics<T>& kin,
                           CompositeInertia<T>& ws) {
  for (int k = 0; k < model.nv(); ++k) ws.r_minus[k] = model.M(k);
  for (int k = model.nv() - 1; k >= 0; --k)
    if (const int parent = model.parent(k); parent >= 0)
      ws.r_minus[parent] += ws.r_minus[k].to_parent(kin.phi[k]);
}

// M, both triangles (nv x nv; every entry is written). O(nv x depth) flops, O(nv^2) stores.
template <class T>
void mass_matrix(const Model<T>& model, const LinkKinematics<T>& kin, CompositeInertia<T>& ws,
                 Eigen::Ref<MatrixX<T>> M) {
  set_composite_inertia(model, kin, ws);
  M.setZero();
  for (int k = model.nv() - 1; k >= 0; --k) {
    const Joint<T>& joint = model.joint(k);
    Vector6<T> H = Vector6<T>::Zero();
    H[joint.axis()] = T(1);
    Vector6<T> x = ws.r_minus[k] * H;
    M(k, k) = x[joint.axis()] + joint.r;
    for (int m = k; model.parent(m) >= 0;) {
      x = kin.phi[m].force_to_parent(x);
      m = model.parent(m);
      M(m, k) = M(k, m) = x[model.joint(m).axis()];
    }
  }
}

}  // namespace kalmarm
