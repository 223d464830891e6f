// Section 1: the random model. Truth is mechanics in world axes: forces and moments that add up,
// kinetic energy.
#pragma once

#include "accuracy/paper/rows.hpp"
#include "accuracy/paper/setting.hpp"

namespace kalmarm {

// Poses of the links in world axes.
template <class T>
struct Poses {
  std::vector<Matrix3<T>> R;
  std::vector<Vector3<T>> o;

  explicit Poses(const Setting<T>& s) {
    for (int k = 0; k < s.n(); ++k) {
      const int p = s.process.parent[k];
      const Transform<T>& phi = s.kin.phi[k];
      R.push_back(p < 0 ? phi.R : Matrix3<T>(R[p] * phi.R));
      o.push_back(p < 0 ? phi.p : Vector3<T>(o[p] + R[p] * phi.p));
    }
  }

  // Link coordinates to world axes, about the link's origin.
  Vector6<T> to_world(int k, const Vector6<T>& x) const {
    Vector6<T> out;
    out << R[k] * x.template head<3>(), R[k] * x.template tail<3>();
    return out;
  }

  // The force x about the origin of link m, seen about that of link k: n + (o_m - o_k) x f.
  Vector6<T> moved(int k, int m, const Vector6<T>& x) const {
    const Vector3<T> arm = o[m] - o[k], f = x.template tail<3>();
    Vector6<T> out = x;
    out.template head<3>() += arm.cross(f);
    return out;
  }
};

// M(k) by the momentum of every unit velocity: l = m (v + w x c), L = I_cm w + c x l.
template <class T>
Matrix6<T> inertia_by_momentum(const RigidBody<T>& body) {
  const Matrix3<T> E = rotation(body.axes);
  Matrix6<T> M;
  for (int i = 0; i < 6; ++i) {
    const Vector6<T> twist = Vector6<T>::Unit(i);
    const Vector3<T> w = twist.template head<3>(), v = twist.template tail<3>();
    const Vector3<T> l = body.mass * (v + w.cross(body.com));
    const Vector3<T> spin = E * body.moments.asDiagonal() * E.transpose() * w;
    M.col(i) << spin + body.com.cross(l), l;
  }
  return M;
}

template <class T>
void section_1(const Setting<T>& s, Rows& rows) {
  rows.section("1");
  const int n = s.n();
  const Poses<T> poses(s);

  std::vector<Matrix6<T>> inertia, printed_inertia;
  for (int k = 0; k < n; ++k) {
    inertia.push_back(inertia_by_momentum(s.model.joint(k).body));
    printed_inertia.push_back(s.process.M[k]);
    printed_inertia[k].template bottomRightCorner<3, 3>().setIdentity();
  }
  const MatrixX<T> Q = block_diagonal<T>(inertia);
  rows.erratum({"M(k)", "", "M(k) = [I, m p~; −m p~, U]", "M(k) = [I, m p~; −m p~, m U]",
                "The mass is missing in the lower right block: the units show it, and the momentum "
                "of a moving body."},
               residual(block_diagonal<T>(printed_inertia), Q), residual(s.op.Q, Q));

  // every one-step phi, column by column, against the moment of a moved force
  MatrixX<T> phi = MatrixX<T>::Zero(6, 6 * n), moved = phi;
  for (int k = 0; k < n; ++k)
    if (const int p = s.process.parent[k]; p >= 0)
      for (int i = 0; i < 6; ++i) {
        const Vector6<T> x = Vector6<T>::Unit(i);
        phi.col(6 * k + i) = poses.to_world(p, s.process.phi[k] * x);
        moved.col(6 * k + i) = poses.moved(p, k, poses.to_world(k, x));
      }
  rows.holds({"φ(k,k−1)", "", "φ(k,k−1) = [U, L~; 0, U]"}, residual(phi, moved));

  // any process: w with the physical mean, x by recursion; truth adds up what is outboard, in world
  // axes
  std::vector<Vector6<T>> w(n), x(n);
  for (int k = 0; k < n; ++k) w[k] = s.fs.w_mean[k];
  x = w;
  for (int k = n - 1; k >= 0; --k)
    if (const int p = s.process.parent[k]; p >= 0) x[p] += s.process.phi[k] * x[k];
  MatrixX<T> x_world(6, n), sum = MatrixX<T>::Zero(6, n);
  for (int m = 0; m < n; ++m) {
    x_world.col(m) = poses.to_world(m, x[m]);
    for (int k = m; k >= 0; k = s.process.parent[k])
      sum.col(k) += poses.moved(k, m, poses.to_world(m, w[m]));
  }
  rows.holds({"(1.1)", "", "x⁻(k) = φ(k,k−1) x⁺(k−1) + ω(k)"}, residual(x_world, sum));

  // E: the one-step transitions alone. W + E X adds up what acts on every link, and phi (I - E) = I
  // says that phi is unit triangular and made of their products.
  MatrixX<T> step = MatrixX<T>::Zero(6 * n, 6 * n);
  for (int k = 0; k < n; ++k)
    if (const int p = s.process.parent[k]; p >= 0)
      step.template block<6, 6>(6 * p, 6 * k) = s.process.phi[k];
  const VectorX<T> W = stacked(w), X = s.op.phi * W;
  rows.holds({"(1.2)", "", "x⁺(k) = x⁻(k)"}, residual(VectorX<T>(W + step * X), X));

  std::vector<Matrix6<T>> covariance;
  for (int k = 0; k < n; ++k) covariance.push_back(s.process.W[k] * s.process.W[k].transpose());
  rows.holds({"(1.3)", "", "E[ω(k)] = b(k), cov ω(k) = M(k)"},
             residual(block_diagonal<T>(covariance), Q));

  // the joint torques of the motion are the projections of its forces
  VectorX<T> torque = s.op.H * s.force;
  torque += s.op.r.cwiseProduct(s.a);
  rows.holds({"(1.4)", "", "τ(k) = H(k) x⁺(k)"}, residual(torque, VectorX<T>(s.M * s.a + s.bias)));

  MatrixX<T> X_world(6, n);
  for (int k = 0; k < n; ++k) X_world.col(k) = poses.to_world(k, X.template segment<6>(6 * k));
  VectorX<T> T_composite = s.op.H * (s.op.phi * s.net_force) + s.op.r.cwiseProduct(s.a);
  rows.holds({"(1.5)", "", "X = φW, T = HX"},
             worst({residual(X_world, sum), residual(T_composite, s.tau)}));

  rows.holds({"(1.6)", "", "E(W) = b, cov W = Q = diag M(k)"},
             residual(s.sigma.W * s.sigma.W.transpose(), Q));

  rows.holds({"(1.7)", "", "φ = [φ(k,m)], lower triangular, U on its diagonal"},
             residual(s.op.phi * (s.identity6() - step), s.identity6()));
}

}  // namespace kalmarm
