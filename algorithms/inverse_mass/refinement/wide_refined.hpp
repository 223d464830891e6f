// Guarded refinement (refined.hpp) with the residual in a wider precision: float64 for float32, and
// long double, 64 bits on x86, for float64. Kinematics and Newton-Euler start again from the
// parameters and the state, which are exact, so the residual is that of the mechanism itself:
//   r = tau - ID(x), wide;   d = M^^-1 r;   x <- x + d
// With factors that are right to a digit, x becomes right to the last bits, whatever kS is, and
// |d| / |x| is its error, not an estimate of its size: two random numbers of one size are within a
// factor 3 of each other in 60 per cent of all cases only.
//
// M^^-1 r has no such digit where T cannot hold r: r is small next to what its rounding moves, and
// above kappa ~ 1/u that of a joint torque is enough. M^^ may even be so stiff along an error that
// |d| comes down and the error does not. So where |d| does not come down to the last bits, or D was
// so small that the test for singularity had to look (outcome.suspect), M is factored in the wider
// precision too, and x starts again from there. It is said (outcome.widened). Of wild mechanisms a
// quarter needs it in float32, of robots none was seen to.
#pragma once

#include <optional>
#include <string>

#include "algorithms/inverse_mass/refined.hpp"

namespace kalmarm {

template <class V>
struct WideRefined {
  static std::string name() { return "WideRefined<" + V::name() + ">"; }
  static constexpr const char* equation = "guarded refinement, residual in a wider precision";
  template <class T>
  static constexpr bool supports = V::template supports<T>;
  static constexpr int most = 3, enough = 1;
  static constexpr int settled = 4;  // |d| <= settled u |x|: right to the last bits

  template <class T>
  struct Workspace {
    typename V::template Workspace<T> inner;
    RefinementWorkspace<T> refinement_workspace;
    Refinement refinement;  // of the last acceleration
    Model<Wider<T>> model;
    RandomModel<Wider<T>> rm;
    InverseDynamics<Wider<T>> newton_euler;
    VectorX<Wider<T>> wide_tau, wide_x, wide_residual, wide_rhs, wide_d;
    typename V::template Workspace<Wider<T>> wide_inner;
    bool suspect = false;
    std::optional<Outcome> widened;  // of the factorisation that wide_inner holds
    VectorX<T> rhs, scaled_d, unit, x;

    explicit Workspace(const Model<T>& narrow)
        : inner(narrow),
          refinement_workspace(narrow),
          model(narrow.template cast<Wider<T>>()),
          rm(model),
          newton_euler(model),
          wide_tau(narrow.nv()),
          wide_x(narrow.nv()),
          wide_residual(narrow.nv()),
          wide_rhs(narrow.nv()),
          wide_d(narrow.nv()),
          wide_inner(model),
          rhs(narrow.nv()),
          scaled_d(narrow.nv()),
          unit(narrow.nv()),
          x(narrow.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws) {
    set_position(ws.model, rm.q, ws.rm);
    ws.widened.reset();
    const Outcome outcome = V::factor(model, rm, ws.inner);
    ws.suspect = outcome.suspect;
    return outcome;
  }

  // a (nv) from tau (nv), with the bias of rm, after factor.
  template <class T>
  static void acceleration(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                           Workspace<T>& ws, VectorX<T>& a) {
    set_velocity(ws.model, rm.qd, ws.rm);
    ws.wide_tau = tau.template cast<Wider<T>>();
    V::acceleration(model, rm, tau, ws.inner, a);
    ws.refinement = refine_to_last_bits(
        model, rm, ws,
        [&] {
          inverse_dynamics(ws.model, ws.rm, ws.wide_x, ws.newton_euler,
                           Eigen::Ref<VectorX<Wider<T>>>(ws.wide_residual));
        },
        [&] { V::acceleration(ws.model, ws.rm, ws.wide_tau, ws.wide_inner, ws.wide_x); }, a);
  }

  // x = M^-1 tau, after factor.
  template <class T>
  static void solve(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    ws.wide_tau = tau.template cast<Wider<T>>();
    V::solve(model, rm, tau, ws.inner, x);
    refine_to_last_bits(
        model, rm, ws,
        [&] {
          mass_times(ws.model, ws.rm, ws.wide_x, ws.newton_euler,
                     Eigen::Ref<VectorX<Wider<T>>>(ws.wide_residual));
        },
        [&] { V::solve(ws.model, ws.rm, ws.wide_tau, ws.wide_inner, ws.wide_x); }, x);
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
  // torques() writes the torques of wide_x into wide_residual; start() answers in wide_x by the
  // factors of the wider precision.
  template <class T, class Torques, class Start>
  static Refinement refine_to_last_bits(const Model<T>& model, const RandomModel<T>& rm,
                                        Workspace<T>& ws, const Torques& torques,
                                        const Start& start, VectorX<T>& x) {
    const auto set_residual = [&](const VectorX<T>& y) {
      ws.wide_x = y.template cast<Wider<T>>();
      torques();
      ws.wide_residual = ws.wide_tau - ws.wide_residual;
    };
    const auto solve_narrow = [&](const VectorX<T>& rhs, VectorX<T>& d) {
      V::solve(model, rm, rhs, ws.inner, d);
    };
    const Refinement narrow = refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          set_residual(y);
          solve_scaled(ws.wide_residual, solve_narrow, ws.rhs, ws.scaled_d, d);
        },
        ws.refinement_workspace, x);
    if (!ws.suspect && narrow.error <= settled * unit_roundoff<T>()) return narrow;

    if (!ws.widened) ws.widened = V::factor(ws.model, ws.rm, ws.wide_inner);
    if (!*ws.widened) return narrow;
    start();
    x = ws.wide_x.template cast<T>();
    const auto solve_wide = [&](const VectorX<Wider<T>>& rhs, VectorX<Wider<T>>& d) {
      V::solve(ws.model, ws.rm, rhs, ws.wide_inner, d);
    };
    Refinement wide = refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          set_residual(y);
          solve_scaled(ws.wide_residual, solve_wide, ws.wide_rhs, ws.wide_d, d);
        },
        ws.refinement_workspace, x);
    wide.widened = true;
    return wide;
  }
};

}  // namespace kalmarm
