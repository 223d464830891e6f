// What every engine in double answers in the same way, whatever its kernels for M^-1 are: M, inverse
// dynamics and derivatives, by the spatial kernels.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/fast/engine/acceptance.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/engine/rows_in_lanes.hpp"
#include "algorithms/model/plain.hpp"

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

class CommonEngine : public Engine<double> {
 public:
  CommonEngine(const RobotModel& robot, const EngineOptions& options)
      : model_(model_of(robot)),
        lowered_(model_, options.zeros, accepted_error(tolerance_of_sweeps(options))),
        acceptance_(robot, lowered_, tolerance_of_sweeps(options)),
        rows_(lowered_, acceptance_, options.selection) {
    if (options.wants(Want::mass)) mass_.emplace(lowered_, options.triangles);
    if (options.wants(Want::inverse_dynamics)) inverse_dynamics_.emplace(lowered_);
    if (!options.wants(Want::derivatives)) return;
    derivatives_.emplace(lowered_);
    if (lowered_.may_lose_D()) loss_.emplace(lowered_);
  }

  bool answers_in_part() const final { return true; }

  void reserve_workers(Want what, int count) override {
    if (what == Want::inverse_dynamics || what == Want::mass || what == Want::derivatives)
      rows_.reserve(what, count);
  }

  void inverse_dynamics(int worker, int count, const double* q, const double* qd, const double* qdd,
                        double* tau) final {
    rows_.inverse_dynamics(worker, count, q, qd, qdd, tau);
  }

  void inverse_dynamics(const double* q, const double* qd, const double* qdd, double* tau) final {
    fast_inverse_dynamics(lowered_, q, qd, qdd, *inverse_dynamics_, tau);
  }

  void mass(const double* q, double* M) final { mass_->fill(lowered_, q, M); }

  void mass(int worker, int count, const double* q, double* M, Outcome* outcomes,
            char* left_over) final {
    rows_.mass(worker, count, q, M, outcomes, left_over);
  }

  void derivatives(int worker, int count, const double* q, const double* qd, const double* tau,
                   double* da_dq, double* da_dqd, double* da_dtau, double* a, Outcome* outcomes,
                   char* left_over) final {
    rows_.derivatives(worker, count, q, qd, tau, da_dq, da_dqd, da_dtau, a, outcomes, left_over);
  }

 protected:
  // Whether the results are finite stands in terms().
  void set_derivatives(const double* q, const double* qd, const double* tau, double* da_dq,
                       double* da_dqd, double* da_dtau, double* a) {
    fast_derivatives(lowered_, q, qd, tau, *derivatives_, da_dq, da_dqd, da_dtau, a);
  }
  const DerivativeTerms<double>& terms() const { return derivatives_->terms; }

  // How wrong a D that derivatives at q stand on can be, where that may count: their sweep has no test of
  // its own, so that the margin of another is asked first.
  RoundingLoss loss_of_derivatives(const double* q) {
    if (!loss_) return {};
    covariance_factor(lowered_, q, loss_->factors);
    return loss_->factors.margin > 0 ? RoundingLoss{} : loss_->bound.look(lowered_, q);
  }

  const Model<double>& model() const { return model_; }
  const LoweredModel<double>& lowered() const { return lowered_; }
  const Acceptance<double>& acceptance() const { return acceptance_; }
  RowsInLanes<double>& rows() { return rows_; }

 private:
  struct LossOfD {
    FastFactors<double> factors;
    RoundingBound<double> bound;

    explicit LossOfD(const LoweredModel<double>& model) : factors(model), bound(model) {}
  };

  // What is refined in any case starts from a sweep like any other.
  static double tolerance_of_sweeps(const EngineOptions& options) {
    return options.tolerance < least_tolerance_of_double ? default_tolerance<double>
                                                         : options.tolerance;
  }

  Model<double> model_;
  LoweredModel<double> lowered_;
  Acceptance<double> acceptance_;
  RowsInLanes<double> rows_;
  std::optional<FastMass<double>> mass_;
  std::optional<InverseDynamicsWorkspace<double>> inverse_dynamics_;
  std::optional<DerivativeWorkspace<double>> derivatives_;
  std::optional<LossOfD> loss_;  // for derivatives, of robots that can lose a D
};

}  // namespace kalmarm
