// Filter and smoother by the conventional update for a model whose inertia changes from one call to
// the next, as in a fit: the test for singularity of factors.hpp is prepared for one model only.
//
//   D(k) = H P- H' + r(k),   g(k) = P- H' / D     tips to base (3.6), (3.10)
#pragma once

#include "algorithms/study/inverse_mass/sweeps.hpp"
#include "algorithms/study/riccati/conventional.hpp"

namespace kalmarm {

template <class T>
struct FitFilter {
  struct Factors : Gains<T> {
    Conventional::Workspace<T> update;

    explicit Factors(const Model<T>& model) : Gains<T>(model, false), update(model) {}
  };
  Factors factors;
  Sweeps<T> sweeps;

  explicit FitFilter(const Model<T>& model) : factors(model), sweeps(model) {}

  // D and g of every joint, after set_position; false where a D(k) is not positive. About 400 flops
  // a link.
  bool factor(const Model<T>& model, const LinkKinematics<T>& kin) {
    Conventional::start(model, kin, factors.update);
    for (int k = model.nv() - 1; k >= 0; --k) {
      factors.D[k] = Conventional::measure(model, k, factors.update, factors.g[k]);
      if (!(factors.D[k] > T(0))) return false;
      if (model.parent(k) >= 0) Conventional::propagate(model, kin, k, factors.update);
    }
    return true;
  }
};

}  // namespace kalmarm
