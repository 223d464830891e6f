// Guarded refinement (refinement.hpp) with the residual in a wider precision: float64 for float32,
// and long double, 64 bits on x86, for float64. Kinematics and Newton-Euler start again from the
// parameters and the state, which are exact, so the residual is that of the mechanism itself:
//   r = tau - ID(x), wide;   d = M^^-1 r;   x <- x + d
// With factors that are right to a digit, x becomes right to the last bits, whatever kS is, and
// |d| / |x| is its error, not an estimate of its size: two random numbers of one size are within a
// factor 3 of each other in 60 per cent of all cases only.
//
// M^^-1 r has no such digit where T cannot hold r: r is small next to what its rounding moves, and
// above kappa ~ 1/u that of a joint torque is enough. M^^ may even be so stiff along an error that
// |d| comes down and the error does not. So where |d| does not come down to the last bits, or D was
// so small that the test for singularity had to look (Outcome::Rung::refined), M is factored in the wider
// precision too, and x starts again from there. It is said (outcome.widened). Of wild mechanisms a
// quarter needs it in float32, of robots none was seen to.
#pragma once

#include <optional>
#include <string>

#include "algorithms/study/inverse_mass/refinement/refined_variant.hpp"

namespace kalmarm {

template <class V>
struct WideResidualScheme {
  using Inner = V;
  static std::string name() { return "WideRefined<" + V::name() + ">"; }
  static constexpr const char* equation = "guarded refinement, residual in a wider precision";
  template <class T>
  static constexpr bool supports = V::template supports<T>;
  static constexpr int most = 3, enough = 1;
  static constexpr int settled = 4;  // |d| <= settled u |x|: right to the last bits

  template <class T>
  struct Workspace {
    typename V::template Workspace<T> inner;
    VectorX<T> rhs, scaled_d;
    bool looked_at = false;
    Model<Wider<T>> model;
    LinkKinematics<Wider<T>> kin;
    Residual<Wider<T>> residual;
    VectorX<Wider<T>> wide_tau, wide_x, wide_rhs, wide_d;
    typename V::template Workspace<Wider<T>> wide_inner;
    std::optional<Outcome> widened;  // of the factorisation that wide_inner holds

    explicit Workspace(const Model<T>& narrow)
        : inner(narrow),
          rhs(narrow.nv()),
          scaled_d(narrow.nv()),
          model(narrow.template cast<Wider<T>>()),
          kin(model),
          residual(model),
          wide_tau(narrow.nv()),
          wide_x(narrow.nv()),
          wide_rhs(narrow.nv()),
          wide_d(narrow.nv()),
          wide_inner(model) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    set_position(ws.model, kin.q, ws.kin);
    ws.widened.reset();
    const Outcome outcome = V::factor(model, kin, ws.inner);
    ws.looked_at = outcome.rung > Outcome::Rung::float64;
    return outcome;
  }

  template <class Equation, class T>
  static Refinement solve(const Model<T>& model, const LinkKinematics<T>& kin,
                          const VectorX<T>& tau, Workspace<T>& ws, RefinementWorkspace<T>& loop,
                          VectorX<T>& x) {
    if constexpr (!Equation::linear) set_velocity(ws.model, kin.qd, ws.kin);
    ws.wide_tau = tau.template cast<Wider<T>>();
    Equation::template solve<V>(model, kin, tau, ws.inner, x);
    const Refinement narrow = refine_by<Equation, T>(
        [&](const VectorX<T>& rhs, VectorX<T>& d) { V::solve(model, kin, rhs, ws.inner, d); },
        ws.rhs, ws.scaled_d, ws, loop, x);
    if (!ws.looked_at && narrow.error <= settled * unit_roundoff<T>()) return narrow;

    if (!ws.widened) ws.widened = V::factor(ws.model, ws.kin, ws.wide_inner);
    if (!*ws.widened) return narrow;
    Equation::template solve<V>(ws.model, ws.kin, ws.wide_tau, ws.wide_inner, ws.wide_x);
    x = ws.wide_x.template cast<T>();
    Refinement wide = refine_by<Equation, T>(
        [&](const VectorX<Wider<T>>& rhs, VectorX<Wider<T>>& d) {
          V::solve(ws.model, ws.kin, rhs, ws.wide_inner, d);
        },
        ws.wide_rhs, ws.wide_d, ws, loop, x);
    wide.widened = true;
    return wide;
  }

 private:
  // Refines x by solve(rhs, d) of factors in the scalar N.
  template <class Equation, class T, class N, class Solve>
  static Refinement refine_by(const Solve& solve, VectorX<N>& rhs, VectorX<N>& scaled_d,
                              Workspace<T>& ws, RefinementWorkspace<T>& loop, VectorX<T>& x) {
    return refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          ws.wide_x = y.template cast<Wider<T>>();
          set_residual<Equation>(ws.model, ws.kin, ws.wide_tau, ws.wide_x, ws.residual);
          solve_scaled(ws.residual.r, solve, rhs, scaled_d, d);
        },
        loop, x);
  }
};

template <class V>
using WideRefined = RefinedVariant<WideResidualScheme<V>>;

}  // namespace kalmarm
