// Derivatives of the mass matrix M = H phi Q phi* H* + diag(r), (5.1), over theta and r.
//
//   dM(i,j) = sum over links b outboard of both of y_i(b)' dM(b) y_j(b),   y_i(b) = phi'(i,b) H'(i)
// with y_i(b) the velocity of link b where only joint i moves (regressor.hpp), and dr on the
// diagonal. Rows of the Jacobian are the lower triangle of M, row by row: entry (i,j), i >= j, is
// row i (i + 1) / 2 + j.
#pragma once

#include <vector>

#include "algorithms/model/link_kinematics.hpp"
#include "algorithms/study/derivatives/inertial_rows.hpp"
#include "algorithms/study/derivatives/subtrees.hpp"

namespace kalmarm {

template <class T>
struct MassJacobian {
  Subtrees subtrees;
  std::vector<Vector6<T>> y;  // y_i(b) at i nv + b

  explicit MassJacobian(const Model<T>& model) : subtrees(model), y(model.nv() * model.nv()) {}
};

inline int lower_triangle_size(int nv) { return nv * (nv + 1) / 2; }
inline int lower_triangle_row(int i, int j) { return lower_triangle_size(i) + j; }

// d(lower triangle of M)/dtheta (nv (nv + 1) / 2 x 10 nv) and /dr (the same x nv), after
// set_position; every entry is written. 38 flops a triple of two joints and a link outboard of
// both.
template <class T>
void mass_jacobian(const Model<T>& model, const LinkKinematics<T>& kin, MassJacobian<T>& ws,
                   RowMatrixRef<T> by_theta, RowMatrixRef<T> by_r) {
  constexpr int n = body_parameters;
  const int nv = model.nv();
  by_theta.setZero();
  by_r.setZero();
  for (int i = 0; i < nv; ++i) {
    Vector6<T>* const y_i = &ws.y[i * nv];
    y_i[i] = Vector6<T>::Unit(model.joint(i).axis());
    for (const int b : ws.subtrees.outboard(i))
      y_i[b] = kin.phi[b].motion_from_parent(y_i[model.parent(b)]);
    for (int j = i; j >= 0; j = model.parent(j)) {
      const Vector6<T>* const y_j = &ws.y[j * nv];
      auto row = by_theta.row(lower_triangle_row(i, j));
      row.template segment<n>(n * i) = bilinear(y_i[i], y_j[i]);
      for (const int b : ws.subtrees.outboard(i))
        row.template segment<n>(n * b) = bilinear(y_i[b], y_j[b]);
    }
    by_r(lower_triangle_row(i, i), i) = T(1);
  }
}

}  // namespace kalmarm
