// Factors in float32, residual in float64: refinement (refinement.hpp) of a float32 variant up to
// the accuracy of float64, as long as u32 times what the variant loses is well below one. Four
// steps take 1e-7 below 1e-16 even where a step gains two digits only.
#pragma once

#include <string>
#include <type_traits>

#include "algorithms/study/inverse_mass/refinement/refined_variant.hpp"

namespace kalmarm {

template <class V>
struct NarrowFactorsScheme {
  using Inner = V;
  static constexpr bool mixed_precision = true;
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
    Residual<T> residual;
    VectorX<float> rhs, x32;

    explicit Workspace(const Model<T>& exact)
        : model(exact.template cast<float>()),
          rm(model),
          inner(model),
          residual(exact),
          rhs(exact.nv()),
          x32(exact.nv()) {}
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

  template <class Equation, class T>
  static Refinement solve(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                          Workspace<T>& ws, RefinementWorkspace<T>& loop, VectorX<T>& x) {
    const auto solve_narrow = [&](const VectorX<float>& rhs, VectorX<float>& x32) {
      V::solve(ws.model, ws.rm, rhs, ws.inner, x32);
    };
    if constexpr (Equation::linear) {
      solve_scaled(tau, solve_narrow, ws.rhs, ws.x32, x);
    } else {  // the bias does not scale with tau
      ws.rhs = tau.template cast<float>();
      Equation::template solve<V>(ws.model, ws.rm, ws.rhs, ws.inner, ws.x32);
      x = ws.x32.template cast<T>();
    }
    return refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          set_residual<Equation>(model, rm, tau, y, ws.residual);
          solve_scaled(ws.residual.r, solve_narrow, ws.rhs, ws.x32, d);
        },
        loop, x);
  }
};

template <class V>
using MixedPrecision = RefinedVariant<NarrowFactorsScheme<V>>;

}  // namespace kalmarm
