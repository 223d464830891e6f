// One state after another, in double, whatever the kernels for M^-1 are: M, inverse dynamics and
// derivatives, by the spatial kernels.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/fast/ladder/engine_in_double.hpp"

namespace kalmarm {

// Of derivatives, which carry no error of their own: `judged`, which is ok, without its error. They
// warn where a D of their sweep may be wrong by 1 per cent, as `loss` says.
inline Outcome of_derivatives(Outcome judged, const RoundingLoss& loss) {
  judged.error = Outcome{}.error;
  judged.rung = Outcome::Rung::float64;
  if (loss.bound < largest_error_of_D || judged.near_singular) return judged;
  judged.near_singular = true;
  judged.joint = loss.joint;
  judged.D = loss.D;
  judged.scale = loss.scale;
  return judged;
}

class RigidState {
 public:
  RigidState(const ModelsInDouble& models, const EngineOptions& options)
      : models_(&models), width_(lowered().widths(options.selection.size())) {
    if (options.wants(Want::mass)) mass_.emplace(lowered(), options.triangles);
    if (options.wants(Want::inverse_dynamics)) inverse_dynamics_.emplace(lowered());
    if (!options.wants(Want::derivatives)) return;
    derivatives_.emplace(lowered());
    if (lowered().may_lose_D()) loss_.emplace(lowered());
  }

  Outcome inverse_dynamics(const Call<double>& call) {
    fast_inverse_dynamics(lowered(), call.q, call.qd, call.tau, *inverse_dynamics_, call.out,
                          forces_of(call));
    return {};
  }

  Outcome mass(const Call<double>& call) {
    mass_->fill(lowered(), call.q, contacts_of(call), call.out);
    return {};
  }

  // Whether all results are finite.
  bool derivatives(const Call<double>& call) {
    std::array<double*, 3> X = call.derivatives;
    for (std::size_t i = 0; i < X.size(); ++i)
      if (!X[i]) X[i] = unwanted(i);
    fast_derivatives(lowered(), call.q, call.qd, call.tau, *derivatives_, X[0], X[1], X[2],
                     call.out, forces_of(call));
    return derivatives_->terms.check == 0;
  }

  // How wrong a D that derivatives stand on can be, where that may count: their sweep has no test of
  // its own, so that the margin of another is asked first.
  RoundingLoss loss_of_derivatives(const Call<double>& call) {
    if (!loss_) return {};
    const Acting<double> loads{.loads = call.loads};
    covariance_factor(lowered(), call.q, loss_->factors, loads);
    return loss_->factors.margin > 0 ? RoundingLoss{} : loss_->bound.look(lowered(), call.q, loads);
  }

 protected:
  const ModelsInDouble& models() const { return *models_; }
  const LoweredModel<double>& lowered() const { return models_->lowered; }
  const Acceptance<double>& acceptance() const { return models_->acceptance; }

  // The rows that are left over.
  template <class State>
  void one_by_one(State& state, int count, const Call<double>& call, Outcome* outcomes,
                  const char* left_over) const {
    for (int i = 0; i < count; ++i) {
      if (!left_over[i]) continue;
      const Call<double> row = call.from(i, width_);
      outcomes[i] = answer_by(state, row);
      if (call.want == Want::mass && !all_finite(width_.out(call.want), row.out))
        outcomes[i] = {.status = Outcome::Status::not_finite};
    }
  }

 private:
  struct LossOfD {
    FastFactors<double> factors;
    RoundingBound<double> bound;

    explicit LossOfD(const LoweredModel<double>& model) : factors(model), bound(model) {}
  };

  // Where a derivative goes that is not wanted.
  double* unwanted(std::size_t i) {
    unwanted_[i].resize(std::size_t(lowered().nv()) * lowered().nv());
    return unwanted_[i].data();
  }

  const ModelsInDouble* models_;
  Widths width_;
  std::optional<FastMass<double>> mass_;
  std::optional<InverseDynamicsWorkspace<double>> inverse_dynamics_;
  std::optional<DerivativeWorkspace<double>> derivatives_;
  std::optional<LossOfD> loss_;  // for derivatives, of robots that can lose a D
  std::array<std::vector<double>, 3> unwanted_;
};

}  // namespace kalmarm
