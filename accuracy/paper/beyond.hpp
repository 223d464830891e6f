// What Kalmarm adds to the paper: trees, several DoF a joint, joint noise, log det M and its
// gradients. Truth is dense: M^-1 by elimination, a block of measurements used at once, traces.
#pragma once

#include <Eigen/LU>

#include "accuracy/paper/rows.hpp"
#include "accuracy/paper/section_5.hpp"
#include "accuracy/paper/setting.hpp"
#include "algorithms/study/derivatives/log_det.hpp"

namespace kalmarm {

// Whether joints i > j lie on different branches.
template <class T>
bool apart(const Setting<T>& s, int i, int j) {
  while (i > j) i = s.process.parent[i];
  return i != j;
}

// The third case of Result 6.1, against the entries of M^-1 between branches. They may all be zero,
// so the residual is relative to the whole of M^-1.
template <class T>
void check_branches(const Setting<T>& s, Rows& rows) {
  const MatrixX<T> entries = s.loop.g.transpose() * across_branches(s) * s.loop.g;
  MatrixX<T> left = MatrixX<T>::Zero(s.n(), s.n()), right = left;
  bool any = false;
  for (int i = 0; i < s.n(); ++i)
    for (int j = 0; j < i; ++j)
      if (apart(s, i, j)) {
        left(i, j) = entries(i, j);
        right(i, j) = s.X(i, j);
        any = true;
      }
  if (any)
    rows.holds({"branches", "Result 6.1",
                "M⁻¹(m,j) = (ψ(c⁻,m⁺)g(m))ᵀ Λ⁻(c) ψ(c⁻,j⁺)g(j), c the deepest common joint of two "
                "branches; 0 without one"},
               static_cast<double>((left - right).norm() / s.X.norm()));
}

// Three turns of a ball joint, measured one after another, against all three at once: S has their
// axes as rows, seen from the first.
template <class T>
void check_several_dof(const Setting<T>& s, Rows& rows) {
  const auto& p = s.process;
  for (int k = 0; k + 2 < s.n(); ++k) {
    if (s.model.joint(k).coordinate != Coordinate::quaternion) continue;
    const Matrix6<T> phi_1 = p.phi[k + 1], phi_2 = phi_1 * p.phi[k + 2];
    const Matrix6<T> P = phi_2 * s.cov.P_minus[k + 2] * phi_2.transpose();
    Eigen::Matrix<T, 3, 6> S;
    S.row(0) = p.H[k].transpose();
    S.row(1) = p.H[k + 1].transpose() * MatrixX<T>(phi_1).partialPivLu().inverse();
    S.row(2) = p.H[k + 2].transpose() * MatrixX<T>(phi_2).partialPivLu().inverse();
    MatrixX<T> D = S * P * S.transpose();
    for (int i = 0; i < 3; ++i) D(i, i) += p.r[k + i];
    const MatrixX<T> SP = S * P;
    const MatrixX<T> P_plus = P - SP.transpose() * D.llt().solve(SP);
    VectorX<T> product(1), determinant(1);
    product[0] = s.cov.D[k] * s.cov.D[k + 1] * s.cov.D[k + 2];
    determinant[0] = D.determinant();
    rows.holds({"several DoF", "",
                "P⁺ = P⁻ − P⁻Sᵀ(SP⁻Sᵀ)⁻¹SP⁻ and Π D = det(SP⁻Sᵀ), one joint axis after another"},
               worst({static_cast<double>((s.cov.P_plus[k] - P_plus).norm() / P.norm()),
                      residual(product, determinant)}));
    return;
  }
}

// An implicit step's matrix M + diag(h damping + h^2 stiffness), inverted column by column.
template <class T>
void check_joint_noise(const Setting<T>& s, Rows& rows) {
  const T h = T(1) / T(100);
  Process<T> stiff = s.process;
  MatrixX<T> M = s.M, X(s.n(), s.n());
  for (int k = 0; k < s.n(); ++k) {
    stiff.b[k].setZero();
    const T damping = T(1 + k % 3), stiffness = T(1000 * (k % 2));
    stiff.r[k] += h * damping + h * h * stiffness;
    M(k, k) += h * damping + h * h * stiffness;
  }
  Covariances<T> cov(stiff);
  const Outcome outcome = set_state_covariances(stiff, cov);
  FilterSmoother<T> fs(stiff);
  T left = T(0), size = T(0);
  for (int k = 0; k < s.n(); ++k) {
    filter(stiff, cov, VectorX<T>(VectorX<T>::Unit(s.n(), k)), fs);
    smooth(stiff, cov, fs);
    X.col(k) = fs.a;
    const Vector6<T> HP = cov.P_plus[k].transpose() * stiff.H[k] - stiff.r[k] * cov.g[k];
    left += HP.squaredNorm();
    size += cov.P_minus[k].squaredNorm();
  }
  using std::sqrt;
  rows.holds({"joint noise", "",
              "(M + r)⁻¹ = (I − L*)D⁻¹(I − L) with D = HP⁻Hᵀ + r, HP⁺ = r gᵀ; r = armature + "
              "h·damping + h²·stiffness"},
             outcome ? worst({residual(MatrixX<T>(M * X), s.identity()),
                              static_cast<double>(sqrt(left / size))})
                     : not_evaluable);
}

// dM(k) of every inertial parameter: M is linear in them.
template <class T>
Matrix6<T> inertia_direction(int parameter) {
  Matrix6<T> dM = Matrix6<T>::Zero();
  if (parameter == 0) {
    dM.template bottomRightCorner<3, 3>().setIdentity();
  } else if (parameter < 4) {
    const Vector3<T> e = Vector3<T>::Unit(parameter - 1);
    dM.template topRightCorner<3, 3>() = cross_matrix(e);
    dM.template bottomLeftCorner<3, 3>() = -cross_matrix(e);
  } else {
    constexpr int entries[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    const auto [i, j] = entries[parameter - 4];
    dM(i, j) = dM(j, i) = T(1);
  }
  return dM;
}

template <class T>
void check_log_det(const Setting<T>& s, Rows& rows) {
  using std::log;
  VectorX<T> sum(1), log_det_M(1);
  sum[0] = log_det(s.cov);
  log_det_M[0] = T(2) * MatrixX<T>(s.M.llt().matrixL()).diagonal().array().log().sum();
  rows.holds({"log det", "", "log det M = Σ log D(k)", "", ""}, residual(sum, log_det_M));

  const LogDetGradient<T> gradient = log_det_gradient(s.cov), slope = score(s.cov, s.fs);
  const MatrixX<T> H_phi = s.op.H * s.op.phi;
  MatrixX<T> gradients(11, s.n()), traces(11, s.n()), scores(11, s.n()), slopes(11, s.n());
  for (int k = 0; k < s.n(); ++k) {
    const MatrixX<T> J = H_phi.template middleCols<6>(6 * k);
    for (int i = 0; i < 11; ++i) {
      MatrixX<T> dM;  // of the mass matrix
      if (i < 10)
        dM = J * inertia_direction<T>(i) * J.transpose();
      else
        dM = VectorX<T>::Unit(s.n(), k) * VectorX<T>::Unit(s.n(), k).transpose();
      traces(i, k) = (s.X * dM).trace();
      slopes(i, k) = (s.a.dot(dM * s.a) - traces(i, k)) / T(2);
    }
    gradients.col(k) << gradient.inertia[k], gradient.r[k];
    scores.col(k) << slope.inertia[k], slope.r[k];
  }
  rows.holds({"∂ log det", "Result 5.4", "d log det M = tr(dM(k) Λ⁻(k)), d/dr(k) = M⁻¹(k,k)"},
             residual(gradients, traces));
  rows.holds({"score", "Result 5.4", "d log p(T) = ½ tr(dM(k)(λ⁻λ⁻ᵀ − Λ⁻)) for T ~ N(Hφb, M)"},
             residual(scores, slopes));
}

template <class T>
void beyond(const Setting<T>& s, Rows& rows) {
  rows.section("beyond");
  const MatrixX<T> I_plus_K = s.identity() + s.loop.K;
  rows.holds({"trees", "", "P⁻(k) = M(k) + Σ φP⁺φᵀ over the children; M = (I + K)D(I + K*)"},
             residual(MatrixX<T>(I_plus_K * s.loop.D.asDiagonal() * I_plus_K.transpose()), s.M));
  check_branches(s, rows);
  check_several_dof(s, rows);
  check_joint_noise(s, rows);
  check_log_det(s, rows);
}

}  // namespace kalmarm
