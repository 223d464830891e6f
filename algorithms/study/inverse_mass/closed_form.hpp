// Result 6.1, corrected: M^-1 in closed form from the factors of any covariance update.
//
// Base to tips, with the covariance of the co-states (5.6), (5.7):
//   L+(k) = phi'(k) L-(parent) phi(k)                                    L: the paper's Lambda
//   L-(k) = (I - gH)' L+ (I - gH) + H'H / D
//   n(k)  = g' L+ (I - gH) - H / D                                       1x6
// and with psi(m-,j+) = phi(m,.) (I - gH) ... phi(.,j), the closed-loop transition from joint j to
// link m:
//   M^-1(j,j) = 1/D(j) + g(j)' L+(j) g(j)
//   M^-1(m,j) = n(m) psi(m-,j+) g(j)                                     m inboard of j
//   M^-1(i,j) = (psi(c-,i+) g(i))' L-(c) (psi(c-,j+) g(j))               i and j on two branches,
//                                                                        c the deepest common joint
//   M^-1(i,j) = 0                                                        where there is none
// (The printed (6.1) has one psi for both places and fails by 20 to 40 per cent.) The third case is
// evaluated as a smoother sweep that starts from L-(c) psi(c-,j+) g(j) and runs outwards, so the
// whole matrix takes O(N^2).
//
// The acceleration is M^-1 times tau less the bias torque, as in (6.4): a product with an explicit
// inverse.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/study/inverse_mass/factors.hpp"
#include "algorithms/study/variant_traits.hpp"

namespace kalmarm {

template <class Update>
struct ClosedForm {
  static std::string name() { return "ClosedForm<" + Update::name() + ">"; }
  static constexpr VariantKind kind = VariantKind::closed_form;
  static constexpr const char* citation = "Rodriguez 1987, Result 6.1";
  static constexpr bool dense = true;
  static constexpr const char* equation = "M^-1 by Result 6.1, corrected";
  template <class T>
  static constexpr bool supports = true;

  template <class T>
  struct Workspace {
    Factors<T, Update> factors;
    InverseDynamics<T> newton_euler;
    std::vector<Matrix6<T>> L_minus;
    std::vector<Vector6<T>> L_g, n;  // L+ g and n'
    std::vector<Vector6<T>> l;       // L- psi g at common joints, and outwards from there
    std::vector<int> column;         // the last column whose path to the base went through here
    std::vector<int> children;
    VectorX<T> torque;
    MatrixX<T> X;

    explicit Workspace(const Model<T>& model)
        : factors(model),
          newton_euler(model),
          L_minus(model.nv()),
          L_g(model.nv()),
          n(model.nv()),
          l(model.nv()),
          column(model.nv(), -1),
          children(model.nv(), 0),
          torque(model.nv()),
          X(model.nv(), model.nv()) {
      for (int k = 0; k < model.nv(); ++k)
        if (const int parent = model.parent(k); parent >= 0) ++children[parent];
    }
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    return kalmarm::factor(model, kin, ws.factors);
  }

  // a (nv) from tau (nv), with the bias of kin, after factor. O(N^2).
  template <class T>
  static void acceleration(const Model<T>& model, const LinkKinematics<T>& kin,
                           const VectorX<T>& tau, Workspace<T>& ws, VectorX<T>& a) {
    a.setZero();
    inverse_dynamics(model, kin, a, ws.newton_euler, Eigen::Ref<VectorX<T>>(ws.torque));
    ws.torque = tau - ws.torque;
    inverse(model, kin, ws, ws.X);
    a.noalias() = ws.X * ws.torque;
  }

  // x = M^-1 tau, after factor. O(N^2).
  template <class T>
  static void solve(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    inverse(model, kin, ws, ws.X);
    x.noalias() = ws.X * tau;
  }

  // M^-1 (nv x nv), both triangles, after factor.
  template <class T>
  static void inverse(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws,
                      MatrixX<T>& X) {
    const Factors<T, Update>& f = ws.factors;
    co_state_covariance(model, kin, ws);
    for (int j = 0; j < model.nv(); ++j) {
      X(j, j) = T(1) / f.D[j] + f.g[j].dot(ws.L_g[j]);

      // inboard of j
      ws.column[j] = j;
      Vector6<T> x = f.g[j];  // psi(.,j+) g(j)
      for (int child = j, m = model.parent(j); m >= 0; child = m, m = model.parent(m)) {
        x = kin.phi[child].force_to_parent(x);
        X(j, m) = X(m, j) = ws.n[m].dot(x);
        if (ws.children[m] > 1) ws.l[m] = ws.L_minus[m] * x;
        ws.column[m] = j;
        x -= f.g[m] * x[model.joint(m).axis()];
      }

      // other branches
      for (int i = 0; i < j; ++i) {
        if (ws.column[i] == j) continue;
        const int c = model.parent(i);
        if (c < 0)
          ws.l[i].setZero();
        else
          ws.l[i] = kin.phi[i].motion_from_parent(ws.l[c]);
        const T entry = f.g[i].dot(ws.l[i]);
        X(j, i) = X(i, j) = entry;
        ws.l[i][model.joint(i).axis()] -= entry;
      }
    }
  }

 private:
  // L-, L+ g and n of every joint.
  template <class T>
  static void co_state_covariance(const Model<T>& model, const LinkKinematics<T>& kin,
                                  Workspace<T>& ws) {
    const Factors<T, Update>& f = ws.factors;
    for (int k = 0; k < model.nv(); ++k) {
      const int parent = model.parent(k), h = model.joint(k).axis();
      const Vector6<T>& g = f.g[k];
      Matrix6<T>& L = ws.L_minus[k];
      if (parent < 0)
        L.setZero();
      else
        L = kin.phi[k].dual_congruence(ws.L_minus[parent]);  // (5.7)
      const Vector6<T> Lg = L * g;
      const T gLg = g.dot(Lg);
      ws.L_g[k] = Lg;
      ws.n[k] = Lg;
      ws.n[k][h] -= gLg + T(1) / f.D[k];
      L.row(h) -= Lg.transpose();  // (5.6): L - H'(Lg)' - Lg H + H'(g'Lg + 1/D) H
      L.col(h) -= Lg;
      L(h, h) += gLg + T(1) / f.D[k];
    }
  }
};

}  // namespace kalmarm
