// Guarded refinement (refined.hpp) with the residual in a wider precision: float64 for float32, and
// long double, 64 bits on x86, for float64. Kinematics and Newton-Euler start again from the
// parameters and the state, which are exact, so the residual is that of the mechanism itself:
//   r = tau - ID(x), wide;   d = M^^-1 r;   x <- x + d
// With factors that are right to a digit, x becomes right to the last bits, whatever kS is, and
// |d| / |x| is its error, not an estimate of its size: two random numbers of one size are within a
// factor 3 of each other in 60 per cent of all cases only.
#pragma once

#include <string>
#include <type_traits>

#include "algorithms/inverse_mass/refined.hpp"

namespace kalmarm {

template <class T>
using Wider = std::conditional_t<std::is_same_v<T, float>, double,
                                 std::conditional_t<std::is_same_v<T, double>, long double, T>>;

template <class V>
struct WideRefined {
  static std::string name() { return "WideRefined<" + V::name() + ">"; }
  static constexpr const char* equation = "guarded refinement, residual in a wider precision";
  template <class T>
  static constexpr bool supports = V::template supports<T>;
  static constexpr int most = 3, enough = 1;

  template <class T>
  struct Workspace {
    typename V::template Workspace<T> inner;
    RefinementWorkspace<T> refinement_workspace;
    Refinement refinement;  // of the last acceleration
    Model<Wider<T>> model;
    RandomModel<Wider<T>> rm;
    InverseDynamics<Wider<T>> newton_euler;
    VectorX<Wider<T>> wide_x, wide_residual;
    VectorX<T> scaled_d, unit, x;

    explicit Workspace(const Model<T>& narrow)
        : inner(narrow),
          refinement_workspace(narrow),
          model(narrow.template cast<Wider<T>>()),
          rm(model),
          newton_euler(model),
          wide_x(narrow.nv()),
          wide_residual(narrow.nv()),
          scaled_d(narrow.nv()),
          unit(narrow.nv()),
          x(narrow.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws) {
    set_position(ws.model, rm.q, ws.rm);
    return V::factor(model, rm, ws.inner);
  }

  // a (nv) from tau (nv), with the bias of rm, after factor.
  template <class T>
  static void acceleration(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                           Workspace<T>& ws, VectorX<T>& a) {
    set_velocity(ws.model, rm.qd, ws.rm);
    V::acceleration(model, rm, tau, ws.inner, a);
    ws.refinement = refine<T>(
        most, enough,
        [&](const VectorX<T>& x, VectorX<T>& d) {
          ws.wide_x = x.template cast<Wider<T>>();
          inverse_dynamics(ws.model, ws.rm, ws.wide_x, ws.newton_euler,
                           Eigen::Ref<VectorX<Wider<T>>>(ws.wide_residual));
          correct(model, rm, tau, ws, d);
        },
        ws.refinement_workspace, a);
  }

  // x = M^-1 tau, after factor.
  template <class T>
  static void solve(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    V::solve(model, rm, tau, ws.inner, x);
    refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          ws.wide_x = y.template cast<Wider<T>>();
          mass_times(ws.model, ws.rm, ws.wide_x, ws.newton_euler,
                     Eigen::Ref<VectorX<Wider<T>>>(ws.wide_residual));
          correct(model, rm, tau, ws, d);
        },
        ws.refinement_workspace, x);
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
  // d = M^^-1 (tau - ID).
  template <class T>
  static void correct(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                      Workspace<T>& ws, VectorX<T>& d) {
    ws.wide_residual = tau.template cast<Wider<T>>() - ws.wide_residual;
    solve_scaled(
        ws.wide_residual,
        [&](const VectorX<T>& rhs, VectorX<T>& x) { V::solve(model, rm, rhs, ws.inner, x); },
        ws.refinement_workspace.residual, ws.scaled_d, d);
  }
};

}  // namespace kalmarm
