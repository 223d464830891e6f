// Derivatives of log D(k), the logarithms of the innovations' variances, over theta and r.
//
//   dD(k) = h'dM(b) h,  h = psi'(k-,b-) H'(k)                    from the loop of (3.6), closed
//   dD(k) = L(k,b)^2 dr(b),  dD(k) = dr(k)
// with h and L as in innovation_jacobian.hpp. Their sum over k is the gradient of log det M
// (log_det.hpp), which costs O(N) where only the sum is wanted.
#pragma once

#include "algorithms/study/derivatives/innovation_jacobian.hpp"

namespace kalmarm {

// d log D / dtheta (nv x 10 nv) and / dr (nv x nv) from gains of the same state; every entry is
// written. About 90 flops a pair of a joint and a link outboard of it.
template <class T>
void log_D_jacobian(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
                    InnovationJacobian<T>& ws, RowMatrixRef<T> by_theta, RowMatrixRef<T> by_r) {
  constexpr int n = body_parameters;
  by_theta.setZero();
  by_r.setZero();
  for (int k = 0; k < model.nv(); ++k) {
    const T per_D = T(1) / gains.D[k];
    ws.h[k] = Vector6<T>::Unit(model.joint(k).axis());
    by_theta.row(k).template segment<n>(n * k) = per_D * bilinear<T>(ws.h[k], ws.h[k]);
    by_r(k, k) = per_D;
    for (const int b : ws.subtrees.outboard(k)) {
      Vector6<T>& h = ws.h[b];
      h = kin.phi[b].motion_from_parent(ws.h[model.parent(b)]);
      const T L = gains.g[b].dot(h);
      h[model.joint(b).axis()] -= L;
      by_theta.row(k).template segment<n>(n * b) = per_D * bilinear<T>(h, h);
      by_r(k, b) = per_D * L * L;
    }
  }
}

}  // namespace kalmarm
