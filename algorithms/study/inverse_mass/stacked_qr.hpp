// The mass matrix by the QR factorisation of its square root, which is never squared:
//   J(k) = phi'(k) J(parent) + H' e_k'                 6 x nv: velocity of link k per joint rate
//   B    = [W'(k) J(k) for every link k; sqrt r(k) e_k' for every joint with noise],   M = B'B
//   B Pi = Q R,   M^-1 = Pi R^-1 R^-T Pi'              Householder, largest column first
// R(k,k) is known to u |B|, so zero shows as u^2 in D = R(k,k)^2. About 12 nv^3 flops.
#pragma once

#include <Eigen/QR>
#include <algorithm>
#include <string>
#include <vector>

#include "algorithms/study/inverse_mass/batch.hpp"
#include "algorithms/study/variant_traits.hpp"

namespace kalmarm {

struct StackedQR {
  static std::string name() { return "StackedQR"; }
  static constexpr VariantKind kind = VariantKind::stacked;
  static constexpr const char* citation = "Golub and Van Loan, 5.4: QR with column pivoting";
  static constexpr bool dense = true;
  static constexpr const char* equation = "M = B'B, B Pi = QR, pivoted, Eigen";
  template <class T>
  static constexpr bool supports = true;

  template <class T>
  struct Workspace {
    InverseDynamics<T> newton_euler;
    std::vector<Eigen::Matrix<T, 6, Eigen::Dynamic>> J;
    MatrixX<T> B, R_inverse;
    Eigen::ColPivHouseholderQR<MatrixX<T>> qr;
    VectorX<T> x, y;

    explicit Workspace(const Model<T>& model)
        : newton_euler(model),
          J(model.nv(), Eigen::Matrix<T, 6, Eigen::Dynamic>::Zero(6, model.nv())),
          B(MatrixX<T>::Zero(rows(model), model.nv())),
          R_inverse(model.nv(), model.nv()),
          qr(rows(model), model.nv()),
          x(model.nv()),
          y(model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    using std::sqrt;
    int row = 0;
    for (int k = 0; k < model.nv(); ++k) {
      const Joint<T>& joint = model.joint(k);
      for (int i = joint.parent; i >= 0; i = model.parent(i))
        ws.J[k].col(i) = kin.phi[k].motion_from_parent(Vector6<T>(ws.J[joint.parent].col(i)));
      ws.J[k](joint.axis(), k) = T(1);
      if (!joint.body.massless()) {
        ws.B.template middleRows<6>(row).noalias() = model.W(k).transpose().lazyProduct(ws.J[k]);
        row += 6;
      }
      if (joint.r > T(0)) ws.B(row++, k) = sqrt(joint.r);
    }
    return check(model, ws);
  }

  // a (nv) from tau (nv), with the bias of kin, after factor. O(nv^2).
  template <class T>
  static void acceleration(const Model<T>& model, const LinkKinematics<T>& kin,
                           const VectorX<T>& tau, Workspace<T>& ws, VectorX<T>& a) {
    a.setZero();
    inverse_dynamics(model, kin, a, ws.newton_euler, Eigen::Ref<VectorX<T>>(ws.x));
    ws.x = tau - ws.x;
    solve(model, kin, ws.x, ws, a);
  }

  // x = M^-1 tau, after factor. O(nv^2).
  template <class T>
  static void solve(const Model<T>& model, const LinkKinematics<T>&, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    const auto R = ws.qr.matrixQR().topRows(model.nv()).template triangularView<Eigen::Upper>();
    const auto& order = ws.qr.colsPermutation().indices();
    VectorX<T>& y = ws.y;
    for (int k = 0; k < model.nv(); ++k) y[k] = tau[order[k]];
    R.transpose().solveInPlace(y);
    R.solveInPlace(y);
    for (int k = 0; k < model.nv(); ++k) x[order[k]] = y[k];
  }

  // M^-1 (nv x nv), both triangles, after factor. O(nv^3).
  template <class T>
  static void inverse(const Model<T>& model, const LinkKinematics<T>&, Workspace<T>& ws,
                      MatrixX<T>& X) {
    const auto R = ws.qr.matrixQR().topRows(model.nv()).template triangularView<Eigen::Upper>();
    const auto& order = ws.qr.colsPermutation().indices();
    ws.R_inverse.setIdentity();
    R.solveInPlace(ws.R_inverse);
    for (int i = 0; i < model.nv(); ++i)
      for (int j = 0; j <= i; ++j)
        X(order[i], order[j]) = X(order[j], order[i]) =
            ws.R_inverse.row(i).dot(ws.R_inverse.row(j));
  }

 private:
  template <class T>
  static int rows(const Model<T>& model) {
    int rows = 0;
    for (int k = 0; k < model.nv(); ++k)
      rows += (model.joint(k).body.massless() ? 0 : 6) + (model.joint(k).r > T(0) ? 1 : 0);
    return std::max(rows, model.nv());
  }

  template <class T>
  static Outcome check(const Model<T>& model, Workspace<T>& ws) {
    ws.qr.compute(ws.B);
    const auto& order = ws.qr.colsPermutation().indices();
    for (int i = 0; i < model.nv(); ++i) {
      const int k = order[i];
      const T pivot = ws.qr.matrixQR()(i, i), e = T(8 * model.nv()) * unit_roundoff<T>();
      const T scale = ws.B.col(k).squaredNorm();
      if (!(pivot * pivot > e * e * scale))
        return {.status = Outcome::Status::singular,
                .joint = k,
                .D = static_cast<double>(T(pivot * pivot)),
                .scale = static_cast<double>(scale)};
    }
    return {};
  }
};

}  // namespace kalmarm
