// Batch: form M and factor it as a whole, as (2.8) stands: a = M^-1 (T - H phi b).
//
//   M     by composite inertias (mass_matrix.hpp)
//   bias  by Newton-Euler at q'' = 0 with gravity as base acceleration (inverse_dynamics.hpp)
//   M^-1  by Backend: a Cholesky-like factorisation of the nv x nv matrix
// A backend turns M into factors and names the pivot that failed; a pivot D(k) <= nv u M(k,k) is
// lost in the factorisation's own backward error, and the matrix is called singular.
#pragma once

#include <string>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/outcome.hpp"

namespace kalmarm {

// What a backend's factorisation says of pivot D at DoF k.
template <class T>
Outcome check_pivot(int k, const T& D, const T& M_kk, int nv) {
  const T floor = T(nv) * unit_roundoff<T>() * M_kk;
  if (D > floor) return {};
  return {D >= -floor ? Outcome::Status::singular : Outcome::Status::indefinite, k,
          static_cast<double>(D), static_cast<double>(M_kk)};
}

template <class Backend>
struct Batch {
  static std::string name() { return std::string("Batch<") + Backend::name + ">"; }
  static constexpr const char* equation = Backend::equation;
  template <class T>
  static constexpr bool supports = Backend::template supports<T>;

  template <class T>
  struct Workspace {
    CompositeInertia<T> composite;
    InverseDynamics<T> newton_euler;
    MatrixX<T> M;
    typename Backend::template Workspace<T> backend;

    explicit Workspace(const Model<T>& model)
        : composite(model), newton_euler(model), M(model.nv(), model.nv()), backend(model) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws) {
    mass_matrix(model, rm, ws.composite, Eigen::Ref<MatrixX<T>>(ws.M));
    return Backend::factor(model, ws.M, ws.backend);
  }

  // a (nv) from tau (nv), with the bias of rm, after factor. O(nv^2).
  template <class T>
  static void acceleration(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                           Workspace<T>& ws, VectorX<T>& a) {
    ws.M.col(0).setZero();  // M is in the factors by now: its first column serves as q'' = 0
    inverse_dynamics(model, rm, ws.M.col(0), ws.newton_euler, Eigen::Ref<VectorX<T>>(a));
    a = tau - a;
    Backend::solve(model, ws.backend, a);
  }

  // M^-1 (nv x nv), both triangles, after factor. O(nv^3).
  template <class T>
  static void inverse(const Model<T>& model, const RandomModel<T>&, Workspace<T>& ws,
                      MatrixX<T>& X) {
    Backend::inverse(model, ws.backend, X);
  }
};

}  // namespace kalmarm
