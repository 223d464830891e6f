// A refined variant, of whatever scheme: the scheme says in which precision M is factored, and in
// which the residual is taken. It has
//   name(), equation, supports<T>                      as a variant has
//   Workspace<T>                                       from a model
//   factor(model, kin, ws) -> Outcome
//   solve<Equation>(model, kin, tau, ws, loop, x) -> Refinement
// where solve, after factor, writes the refined solution x of an equation of refinement.hpp.
#pragma once

#include <string>

#include "algorithms/study/inverse_mass/refinement/refinement.hpp"
#include "algorithms/study/variant_traits.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

template <class Scheme>
struct RefinedVariant {
  using Inner = Scheme;  // what it is made of, whose traits it has too
  static std::string name() { return Scheme::name(); }
  static constexpr VariantKind kind = VariantKind::refined;
  static constexpr const char* citation = "Higham 2002, chapter 12: iterative refinement";
  static constexpr const char* equation = Scheme::equation;
  template <class T>
  static constexpr bool supports = Scheme::template supports<T>;

  template <class T>
  struct Workspace : Scheme::template Workspace<T> {
    RefinementWorkspace<T> loop;
    Refinement refinement;  // of the last acceleration
    VectorX<T> unit, column;

    explicit Workspace(const Model<T>& model)
        : Scheme::template Workspace<T>(model), loop(model), unit(model.nv()), column(model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    return Scheme::template factor<T>(model, kin, ws);
  }

  // a (nv) from tau (nv), with the bias of kin, after factor.
  template <class T>
  static void acceleration(const Model<T>& model, const LinkKinematics<T>& kin,
                           const VectorX<T>& tau, Workspace<T>& ws, VectorX<T>& a) {
    ws.refinement = Scheme::template solve<EquationOfMotion, T>(model, kin, tau, ws, ws.loop, a);
  }

  // x = M^-1 tau, after factor.
  template <class T>
  static void solve(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    Scheme::template solve<MassEquation, T>(model, kin, tau, ws, ws.loop, x);
  }

  // M^-1 (nv x nv), both triangles, after factor: every column refined, the mean of both triangles.
  template <class T>
  static void inverse(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws,
                      MatrixX<T>& X) {
    for (int j = 0; j < X.cols(); ++j) {
      ws.unit.setZero();
      ws.unit[j] = T(1);
      solve(model, kin, ws.unit, ws, ws.column);
      X.col(j) = ws.column;
    }
    for (int j = 0; j < X.cols(); ++j)
      for (int i = 0; i < j; ++i) X(i, j) = X(j, i) = (X(i, j) + X(j, i)) / T(2);
  }
};

// What a workspace has to say of its last acceleration, if it refines.
template <class Workspace>
void report_refinement(const Workspace& ws, Outcome& out) {
  if constexpr (requires { ws.refinement; }) {
    out.error = ws.refinement.error;
    out.steps = ws.refinement.steps;
    out.widened = ws.refinement.widened;
  }
}

}  // namespace kalmarm
