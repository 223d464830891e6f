// The certified form of the fast path behind an Outcome: every answer comes with its error, by the
// residual in twice the precision (certified_acceleration.hpp, certified_factors.hpp).
// Outcome::error says how wrong it is, relatively; Outcome::recomputed, that the conventional form's own
// factors did not do.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_factors.hpp"
#include "algorithms/fast/engine/common_engine.hpp"

namespace kalmarm {

class CertifiedEngine final : public CommonEngine {
 public:
  using CommonEngine::derivatives;  // of rows

  CertifiedEngine(const RobotModel& robot, const EngineOptions& options)
      : CommonEngine(robot, options), models_(lowered(), robot, options.tolerance) {
    const auto wants = [&](Want want) { return options.wants(want); };
    if (wants(Want::acceleration) || wants(Want::derivatives)) one_.emplace(models_);
    if (options.wants_factors()) factors_.emplace(models_, options);
  }

  Outcome forward_dynamics(const double* q, const double* qd, const double* tau,
                           double* a) override {
    return one_->acceleration(models_, q, qd, tau, a);
  }

  // Derivatives are asked for state by state, since the a among them is certified.
  void reserve_workers(Want what, int count) override {
    if (what == Want::derivatives) return;
    CommonEngine::reserve_workers(what, count);
    while (what == Want::acceleration && static_cast<int>(workers_.size()) < count)
      workers_.emplace_back(models_);
  }

  int forward_dynamics(int worker, int count, const double* q, const double* qd, const double* tau,
                       double* a, Outcome* outcomes) override {
    Worker& w = workers_[worker];
    const std::ptrdiff_t nq = models_.lowered.nq(), nv = models_.lowered.nv();
    int failed = 0;
    w.rows.for_each(
        models_.lowered, count, q, qd, tau, a, [&](int first, int states, const auto& store) {
          Verdict refined[RowBlock<double>::lanes];
          w.sweep.acceleration(models_, w.rows.q.data(), w.rows.qd.data(), w.rows.tau_or_qdd.data(),
                               states, w.rows.out.data(), refined);
          store();
          for (int lane = 0; lane < states; ++lane) {
            const std::ptrdiff_t i = first + lane;
            outcomes[i] =
                refined[lane].settled
                    ? outcome_of(refined[lane])
                    : w.one.last_resort(models_, q + i * nq, qd + i * nv, tau + i * nv, a + i * nv);
            failed += !outcomes[i];
          }
        });
    return failed;
  }

  Outcome inverse(const double* q, double* X) override { return factors_->inverse(q, X); }
  Outcome factor(const double* q) override { return factors_->factor(q); }
  Outcome solve(int columns, const double* taus, double* X) override {
    return factors_->solve(columns, taus, X);
  }
  Outcome diagonal(const double* q, double* x) override { return factors_->diagonal(q, x); }
  Outcome log_det(const double* q, double& x) override { return factors_->log_det(q, x); }
  Outcome selected(const double* q, double* X) override { return factors_->selected(q, X); }

  // a is certified. The derivatives are the covariance form's, and the outcome is theirs.
  Outcome derivatives(const double* q, const double* qd, const double* tau, double* da_dq,
                      double* da_dqd, double* da_dtau, double* a) override {
    set_derivatives(q, qd, tau, da_dq, da_dqd, da_dtau, a);
    const bool finite = terms().check == 0;
    const Outcome out = one_->acceleration(models_, q, qd, tau, a);
    if (out && !finite) return {.status = Outcome::Status::not_finite};
    return out ? of_derivatives(out, loss_of_derivatives(q)) : out;
  }

 private:
  struct Worker {
    CertifiedSweep<StateLanes<double>> sweep;
    CertifiedAcceleration one;  // of what its own factors do not settle
    RowBlock<double> rows;

    explicit Worker(const CertifiedModels& models)
        : sweep(models), one(models), rows(models.lowered) {}
  };

  CertifiedModels models_;
  std::optional<CertifiedAcceleration> one_;
  std::optional<CertifiedFactors> factors_;
  std::vector<Worker> workers_;
};

}  // namespace kalmarm
