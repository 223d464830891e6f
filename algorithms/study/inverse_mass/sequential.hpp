// Filter and smoother (sweeps.hpp) on the factors of any covariance update: the paper's sequential
// algorithm, O(N) for one right-hand side.
#pragma once

#include <string>

#include "algorithms/study/inverse_mass/sweeps.hpp"
#include "algorithms/study/variant_traits.hpp"

namespace kalmarm {

// All but the acceleration, where the bias enters.
template <class Update>
struct FilterAndSmoother {
  using Inner = Update;

  template <class T>
  static constexpr bool supports = true;

  template <class T>
  struct Workspace {
    Factors<T, Update> factors;
    Sweeps<T> sweeps;

    explicit Workspace(const Model<T>& model) : factors(model), sweeps(model) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    return kalmarm::factor(model, kin, ws.factors);
  }

  // Of M + J'DJ of contacts: what follows is of that matrix then.
  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin,
                        std::span<const ContactRow<T>> contacts, Workspace<T>& ws) {
    return kalmarm::factor(model, kin, contacts, ws.factors);
  }

  // x = M^-1 tau, after factor.
  template <class T>
  static void solve(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    kalmarm::solve(model, kin, ws.factors, tau, ws.sweeps, x);
  }

  // M^-1 (nv x nv), both triangles, after factor.
  template <class T>
  static void inverse(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws,
                      MatrixX<T>& X) {
    inverse_by_columns(model, kin, ws.factors, ws.sweeps, X);
  }
};

template <class Update>
struct Sequential : FilterAndSmoother<Update> {
  static std::string name() { return "Sequential<" + Update::name() + ">"; }
  static constexpr VariantKind kind = VariantKind::sequential;
  static constexpr const char* citation = "Rodriguez 1987, (3.3)";
  static constexpr const char* equation = "M^-1 = (I - L*) D^-1 (I - L), (3.3)";

  // a (nv) from tau (nv), with the bias of kin, after factor. About 220 flops a link.
  template <class T, class Workspace>
  static void acceleration(const Model<T>& model, const LinkKinematics<T>& kin,
                           const VectorX<T>& tau, Workspace& ws, VectorX<T>& a) {
    for (int k = 0; k < model.nv(); ++k) ws.sweeps.z[k] = kin.b[k];
    filter(model, kin, ws.factors, tau, ws.sweeps, [&](int k, Vector6<T>& z) {
      z += Update::P_plus_times(k, kin.c[k], ws.factors.update);
    });
    smooth_with_bias(model, kin, ws.factors, ws.sweeps, a);
  }
};

}  // namespace kalmarm
