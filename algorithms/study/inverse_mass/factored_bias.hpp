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

#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/variant_traits.hpp"

namespace kalmarm {

template <class Update>
struct FactoredBias : FilterAndSmoother<WithBias<Update>> {
  static std::string name() { return "FactoredBias<" + Update::name() + ">"; }
  static constexpr VariantKind kind = VariantKind::factored_bias;
  static constexpr const char* citation = "Bierman 1977, chapter 5, on the paper's (3.3)";
  static constexpr const char* equation = "(3.3), the bias as a vector of noise, b = W zeta";

  // a (nv) from tau (nv), with the bias of kin, after factor.
  template <class T, class Workspace>
  static void acceleration(const Model<T>& model, const LinkKinematics<T>& kin,
                           const VectorX<T>& tau, Workspace& ws, VectorX<T>& a) {
    for (Vector6<T>& s : ws.sweeps.z) s.setZero();
    filter(model, kin, ws.factors, tau, ws.sweeps, [](int, Vector6<T>&) {});
    for (int k = 0; k < model.nv(); ++k)
      ws.sweeps.e[k] -= WithBias<Update>::bias_innovation(k, ws.factors.update);
    smooth_with_bias(model, kin, ws.factors, ws.sweeps, a);
  }
};

}  // namespace kalmarm
