// Guarded refinement (refinement.hpp) of any variant in its own precision. |d| / |x| sees all of
// the error but the rounding that factors and residual have in common, that of phi.
#pragma once

#include <string>

#include "algorithms/study/inverse_mass/refinement/refined_variant.hpp"

namespace kalmarm {

template <class V>
struct OnePrecisionScheme {
  using Inner = V;
  static std::string name() { return "Refined<" + V::name() + ">"; }
  static constexpr const char* equation = "guarded refinement, residual by Newton and Euler";
  template <class T>
  static constexpr bool supports = V::template supports<T>;
  static constexpr int most = 1, enough = 4;

  template <class T>
  struct Workspace {
    typename V::template Workspace<T> inner;
    Residual<T> residual;

    explicit Workspace(const Model<T>& model) : inner(model), residual(model) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    return V::factor(model, kin, ws.inner);
  }

  template <class Equation, class T>
  static Refinement solve(const Model<T>& model, const LinkKinematics<T>& kin,
                          const VectorX<T>& tau, Workspace<T>& ws, RefinementWorkspace<T>& loop,
                          VectorX<T>& x) {
    Equation::template solve<V>(model, kin, tau, ws.inner, x);
    return refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          set_residual<Equation>(model, kin, tau, y, ws.residual);
          V::solve(model, kin, ws.residual.r, ws.inner, d);
        },
        loop, x);
  }
};

template <class V>
using Refined = RefinedVariant<OnePrecisionScheme<V>>;

}  // namespace kalmarm
