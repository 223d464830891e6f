// Batch: form M and factor it as a whole, as (2.8) stands: a = M^-1 (T - H phi b).
//
//   M     by composite inertias (mass_matrix.hpp)
//   bias  by Newton-Euler at q'' = 0 with gravity as base acceleration (inverse_dynamics.hpp)
//   M^-1  by Backend: a Cholesky-like factorisation of the nv x nv matrix
// A backend turns M into factors and names the pivot that failed: one that is lost in rounding,
//   D(k) <= e(k) = u (nv M(k,k) + 8 t(k)),
// and then the matrix is called singular. The first term is the factorisation's backward error. The
// second is that of M(k,k): t(k) is the largest term, of those that composite inertias outboard of
// k were summed from, that may have cancelled,
//   t(k) = max(tr I(k) / 2,  t(c),  tr I(c) / 2 + 2 |p| |h(c)| + m(c) p'p  over children c),
// I, h and m those of r-(k); a sliding joint counts masses, which do not cancel. Rounding of M and
// of earlier pivots reaches D(k) through row k of L^-1, which is not known here: where it is large,
// a mechanism that is singular twice over may pass (test_outcomes.cpp has one). The filters' test
// (factors.hpp) follows those errors.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/contacts/contact_row.hpp"
#include "algorithms/study/variant_traits.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

// What a backend's factorisation says of pivot D at DoF k, whose rounding error may be e.
template <class T>
Outcome check_pivot(int k, const T& D, const T& e) {
  if (D > e) return {};
  return {.status = D >= -e ? Outcome::Status::singular : Outcome::Status::indefinite,
          .joint = k,
          .D = static_cast<double>(D),
          .scale = static_cast<double>(T(e / unit_roundoff<T>()))};
}

// The same for all pivots of a Cholesky factor G, M = G G', in the order of the DoF. `stopped`: the
// factorisation ended at a pivot that is not positive, with the rows up to there done.
template <class T>
Outcome check_cholesky(const MatrixX<T>& M, const MatrixX<T>& G, bool stopped,
                       const VectorX<T>& e) {
  const int nv = static_cast<int>(M.rows());
  for (int k = 0; k < nv; ++k) {
    const T D = stopped ? T(M(k, k) - G.row(k).head(k).squaredNorm()) : T(G(k, k) * G(k, k));
    if (const Outcome outcome = check_pivot(k, D, e[k]); !outcome) return outcome;
  }
  if (stopped) return {.status = Outcome::Status::indefinite, .joint = nv - 1};
  return {};
}

template <class Backend>
struct Batch {
  static std::string name() { return std::string("Batch<") + Backend::name + ">"; }
  static constexpr VariantKind kind = VariantKind::batch;
  static constexpr const char* citation =
      "Walker and Orin 1982, method 3: composite bodies, Cholesky";
  static constexpr bool dense = true;
  static constexpr const char* equation = Backend::equation;
  template <class T>
  static constexpr bool supports = Backend::template supports<T>;

  template <class T>
  struct Workspace {
    CompositeInertia<T> composite;
    InverseDynamics<T> newton_euler;
    MatrixX<T> M;
    VectorX<T> e, t;
    typename Backend::template Workspace<T> backend;

    explicit Workspace(const Model<T>& model)
        : composite(model),
          newton_euler(model),
          M(model.nv(), model.nv()),
          e(model.nv()),
          t(model.nv()),
          backend(model) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    return factor(model, kin, std::span<const ContactRow<T>>(), ws);
  }

  // Of M + J'DJ of contacts: what follows is of that matrix then. O(nv^2) a contact.
  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin,
                        std::span<const ContactRow<T>> contacts, Workspace<T>& ws) {
    mass_matrix(model, kin, ws.composite, Eigen::Ref<MatrixX<T>>(ws.M));
    for (const ContactRow<T>& row : contacts) {
      contact_jacobian(model, kin, row, ws.t);
      ws.M.noalias() += (row.d * ws.t) * ws.t.transpose();
    }
    set_pivot_errors(model, kin, ws);
    return Backend::factor(model, ws.M, ws.e, ws.backend);
  }

  // a (nv) from tau (nv), with the bias of kin, after factor. O(nv^2).
  template <class T>
  static void acceleration(const Model<T>& model, const LinkKinematics<T>& kin,
                           const VectorX<T>& tau, Workspace<T>& ws, VectorX<T>& a) {
    ws.M.col(0).setZero();  // M is in the factors by now: its first column serves as q'' = 0
    inverse_dynamics(model, kin, ws.M.col(0), ws.newton_euler, Eigen::Ref<VectorX<T>>(a));
    a = tau - a;
    Backend::solve(model, ws.backend, a);
  }

  // x = M^-1 tau, after factor. O(nv^2).
  template <class T>
  static void solve(const Model<T>& model, const LinkKinematics<T>&, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    x = tau;
    Backend::solve(model, ws.backend, x);
  }

  // M^-1 (nv x nv), both triangles, after factor. O(nv^3).
  template <class T>
  static void inverse(const Model<T>& model, const LinkKinematics<T>&, Workspace<T>& ws,
                      MatrixX<T>& X) {
    Backend::inverse(model, ws.backend, X);
  }

 private:
  // e(k) of every pivot. About 20 flops and a square root a link.
  template <class T>
  static void set_pivot_errors(const Model<T>& model, const LinkKinematics<T>& kin,
                               Workspace<T>& ws) {
    using std::max;
    using std::sqrt;
    const T u = unit_roundoff<T>(), nv = T(model.nv());
    ws.t.setZero();
    for (int k = model.nv() - 1; k >= 0; --k) {
      const SpatialInertia<T>& r_minus = ws.composite.r_minus[k];
      const Joint<T>& joint = model.joint(k);
      const T polar = r_minus.I.trace() / T(2);
      ws.t[k] = max(ws.t[k], polar);
      ws.e[k] = u * (nv * ws.M(k, k) + T(8) * (joint.slides ? r_minus.m : ws.t[k]));
      if (joint.parent < 0) continue;
      const T pp = kin.phi[k].p.squaredNorm();
      const T terms = polar + T(2) * sqrt(pp * r_minus.h.squaredNorm()) + r_minus.m * pp;
      ws.t[joint.parent] = max(ws.t[joint.parent], max(ws.t[k], terms));
    }
  }
};

}  // namespace kalmarm
