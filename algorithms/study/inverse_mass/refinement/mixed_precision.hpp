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
    LinkKinematics<float> kin;
    typename V::template Workspace<float> inner;
    Residual<T> residual;
    VectorX<float> rhs, x32;

    explicit Workspace(const Model<T>& exact)
        : model(exact.template cast<float>()),
          kin(model),
          inner(model),
          residual(exact),
          rhs(exact.nv()),
          x32(exact.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    ws.kin.q = kin.q.template cast<float>();
    for (int k = 0; k < model.nv(); ++k) {
      ws.kin.phi[k] = {kin.phi[k].R.template cast<float>(), kin.phi[k].p.template cast<float>()};
      ws.kin.v[k] = kin.v[k].template cast<float>();
      ws.kin.c[k] = kin.c[k].template cast<float>();
      ws.kin.b[k] = kin.b[k].template cast<float>();
    }
    return V::factor(ws.model, ws.kin, ws.inner);
  }

  template <class Equation, class T>
  static Refinement solve(const Model<T>& model, const LinkKinematics<T>& kin,
                          const VectorX<T>& tau, Workspace<T>& ws, RefinementWorkspace<T>& loop,
                          VectorX<T>& x) {
    const auto solve_narrow = [&](const VectorX<float>& rhs, VectorX<float>& x32) {
      V::solve(ws.model, ws.kin, rhs, ws.inner, x32);
    };
    if constexpr (Equation::linear) {
      solve_scaled(tau, solve_narrow, ws.rhs, ws.x32, x);
    } else {  // the bias does not scale with tau
      ws.rhs = tau.template cast<float>();
      Equation::template solve<V>(ws.model, ws.kin, ws.rhs, ws.inner, ws.x32);
      x = ws.x32.template cast<T>();
    }
    return refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          set_residual<Equation>(model, kin, tau, y, ws.residual);
          solve_scaled(ws.residual.r, solve_narrow, ws.rhs, ws.x32, d);
        },
        loop, x);
  }
};

template <class V>
using MixedPrecision = RefinedVariant<NarrowFactorsScheme<V>>;

}  // namespace kalmarm
