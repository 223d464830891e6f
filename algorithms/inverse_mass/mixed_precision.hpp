// Factors in float32, residual in float64: refinement (refined.hpp) of a float32 variant up to the
// accuracy of float64, as long as u32 times what the variant loses is well below one. Four steps
// take 1e-7 below 1e-16 even where a step gains two digits only.
#pragma once

#include <string>

#include "algorithms/inverse_mass/refined.hpp"

namespace kalmarm {

template <class V>
struct MixedPrecision {
  static std::string name() { return "MixedPrecision<" + V::name() + ">"; }
  static constexpr const char* equation = "factored in float32, residual in float64";
  template <class T>
  static constexpr bool supports = std::is_same_v<T, double>;
  static constexpr int most = 4, enough = 1;

  template <class T>
  struct Workspace {
    Model<float> model;
    RandomModel<float> rm;
    typename V::template Workspace<float> inner;
    RefinementWorkspace<T> refinement_workspace;
    Refinement refinement;  // of the last acceleration
    VectorX<float> rhs, x32;
    VectorX<T> unit, x;

    explicit Workspace(const Model<T>& exact)
        : model(exact.template cast<float>()),
          rm(model),
          inner(model),
          refinement_workspace(exact),
          rhs(exact.nv()),
          x32(exact.nv()),
          unit(exact.nv()),
          x(exact.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws) {
    ws.rm.q = rm.q.template cast<float>();
    for (int k = 0; k < model.nv(); ++k) {
      ws.rm.phi[k] = {rm.phi[k].R.template cast<float>(), rm.phi[k].p.template cast<float>()};
      ws.rm.v[k] = rm.v[k].template cast<float>();
      ws.rm.c[k] = rm.c[k].template cast<float>();
      ws.rm.b[k] = rm.b[k].template cast<float>();
    }
    return V::factor(ws.model, ws.rm, ws.inner);
  }

  // a (nv) from tau (nv), with the bias of rm, after factor.
  template <class T>
  static void acceleration(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                           Workspace<T>& ws, VectorX<T>& a) {
    ws.rhs = tau.template cast<float>();
    V::acceleration(ws.model, ws.rm, ws.rhs, ws.inner, ws.x32);
    a = ws.x32.template cast<T>();
    RefinementWorkspace<T>& w = ws.refinement_workspace;
    ws.refinement = refine<T>(
        most, enough,
        [&](const VectorX<T>& x, VectorX<T>& d) {
          inverse_dynamics(model, rm, x, w.newton_euler, Eigen::Ref<VectorX<T>>(w.residual));
          w.residual = tau - w.residual;
          correct(ws, d);
        },
        w, a);
  }

  // x = M^-1 tau, after factor.
  template <class T>
  static void solve(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    RefinementWorkspace<T>& w = ws.refinement_workspace;
    w.residual = tau;
    correct(ws, x);
    refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          mass_times(model, rm, y, w.newton_euler, Eigen::Ref<VectorX<T>>(w.residual));
          w.residual = tau - w.residual;
          correct(ws, d);
        },
        w, x);
  }

  // M^-1 (nv x nv), both triangles, after factor: every column refined.
  template <class T>
  static void inverse(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws,
                      MatrixX<T>& X) {
    inverse_by_solving(
        [&](const VectorX<T>& unit, VectorX<T>& x) { solve(model, rm, unit, ws, x); }, ws.unit,
        ws.x, X);
  }

 private:
  // d = M^^-1 residual, by the factors of float32.
  template <class T>
  static void correct(Workspace<T>& ws, VectorX<T>& d) {
    solve_scaled(
        ws.refinement_workspace.residual,
        [&](const VectorX<float>& rhs, VectorX<float>& x) {
          V::solve(ws.model, ws.rm, rhs, ws.inner, x);
        },
        ws.rhs, ws.x32, d);
  }
};

}  // namespace kalmarm
