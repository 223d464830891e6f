// Filter and smoother with the bias in factored form, carried by the array itself (array.hpp): no
// force that is large because a mass is large is ever formed.
//
// With z- = A-'zeta- + s-, where s is what comes of the joint torques alone,
//   e+(k) = (tau(k) - H s-) / D - y0 / sqrt D                (4.2), (4.6)
//   s+(k) = s- + g (tau(k) - H s-)                           (4.5); zeta takes the rest
//   s-(k) = sum over children c of phi(k,c) s+(c)            (4.4)
// and H s+ = tau where r = 0. The smoother is as in sweeps.hpp.
#pragma once

#include <string>

#include "algorithms/inverse_mass/sweeps.hpp"
#include "algorithms/riccati/array.hpp"

namespace kalmarm {

template <class Update>
struct FactoredBias {
  static std::string name() { return "FactoredBias<" + Update::name() + ">"; }
  static constexpr const char* equation = "(3.3), the bias as a vector of noise, b = W zeta";
  template <class T>
  static constexpr bool supports = true;

  template <class T>
  struct Workspace {
    Factors<T, WithBias<Update>> factors;
    Sweeps<T> sweeps;

    explicit Workspace(const Model<T>& model) : factors(model), sweeps(model) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws) {
    return kalmarm::factor(model, rm, ws.factors);
  }

  // a (nv) from tau (nv), with the bias of rm, after factor.
  template <class T>
  static void acceleration(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                           Workspace<T>& ws, VectorX<T>& a) {
    for (Vector6<T>& s : ws.sweeps.z) s.setZero();
    filter(model, rm, ws.factors, tau, ws.sweeps, [](int, Vector6<T>&) {});
    for (int k = 0; k < model.nv(); ++k)
      ws.sweeps.e[k] -= WithBias<Update>::bias_innovation(k, ws.factors.update);
    smooth_with_bias(model, rm, ws.factors, ws.sweeps, a);
  }

  // x = M^-1 tau, after factor.
  template <class T>
  static void solve(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    kalmarm::solve(model, rm, ws.factors, tau, ws.sweeps, x);
  }

  // M^-1 (nv x nv), both triangles, after factor.
  template <class T>
  static void inverse(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws,
                      MatrixX<T>& X) {
    inverse_by_columns(model, rm, ws.factors, ws.sweeps, X);
  }
};

}  // namespace kalmarm
