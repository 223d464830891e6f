// The fast path's kernels in double on 6-D vectors, by the sweep F (forms.hpp), behind an Outcome. An
// answer whose sums say that it can be used (engine/acceptance.hpp) is the kernel's own; any other is the
// certified form's.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_answer.hpp"
#include "algorithms/fast/engine/acceleration_rows.hpp"
#include "algorithms/fast/engine/common_engine.hpp"
#include "algorithms/fast/factors/log_det.hpp"

namespace kalmarm {

template <class F>
class SpatialEngine final : public CommonEngine {
 public:
  using CommonEngine::derivatives;  // of rows

  SpatialEngine(const RobotModel& robot, const EngineOptions& options)
      : CommonEngine(robot, options),
        robot_(robot),
        accelerations_(lowered(), acceptance(), options.wants(Want::solve)),
        forces_(lowered()) {
    const auto wants = [&](Want want) { return options.wants(want); };
    if (wants(Want::acceleration) || options.wants_factors() || wants(Want::derivatives))
      certified_.emplace(robot, lowered(), options, F::at_rest);
    if (wants(Want::acceleration)) one_.emplace(lowered());
    if (options.wants_factors()) factors_.emplace(lowered());
    if (wants(Want::inverse)) inverse_.emplace(lowered(), options.triangles);
    if (wants(Want::solve)) solver_.emplace(lowered());
    if (wants(Want::diagonal)) diagonal_.emplace(lowered(), InverseDiagonal<double>::Terms::fewest);
    if (options.selection.size() > 0) selected_.select(lowered(), options.selection);
  }

  Outcome forward_dynamics(const double* q, const double* qd, const double* tau,
                           double* a) override {
    F::acceleration(lowered(), q, qd, tau, *one_, a);
    const auto by = acceptance().judge(F::sums(*one_));
    if (acceptance().accepts(one_->margin, by, 0)) return {.error = by.error};
    return certified_->acceleration(q, qd, tau, a);
  }

  void reserve_workers(Want what, int count) override {
    if (what == Want::acceleration) {
      accelerations_.reserve(count);
      EngineOptions alone;
      alone.want = {Want::acceleration};
      alone.tolerance = acceptance().tolerance();
      while (static_cast<int>(climbs_.size()) < count)
        climbs_.emplace_back(robot_, lowered(), alone, F::at_rest);
    } else {
      rows().reserve(what, count);
    }
  }

  int forward_dynamics(int worker, int count, const double* q, const double* qd, const double* tau,
                       double* a, Outcome* outcomes) override {
    Climb& climb = climbs_[worker];
    const std::ptrdiff_t nq = lowered().nq(), nv = lowered().nv();
    climb.left_over.resize(count);
    accelerations_.forward_dynamics(worker, count, q, qd, tau, a, outcomes, climb.left_over.data());
    int failed = 0;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      if (!climb.left_over[i]) continue;
      outcomes[i] = climb.certified.acceleration(q + i * nq, qd + i * nv, tau + i * nv, a + i * nv);
      failed += !outcomes[i];
    }
    return failed;
  }

  Outcome forward_dynamics(const double* q, const double* qd, const double* tau, double* a, int m,
                           const double* B, double* X) override {
    const Outcome out = forward_dynamics(q, qd, tau, a);
    bool by_sweep = out && !out.recomputed;
    if (by_sweep) solve_columns(*one_, m, B, X, [&](std::ptrdiff_t) { by_sweep = false; });
    return by_sweep ? out : Engine::forward_dynamics(q, qd, tau, a, m, B, X);
  }

  void forward_dynamics(int worker, int count, const double* q, const double* qd, const double* tau,
                        double* a, Outcome* outcomes, int m, const double* B, double* X,
                        char* left_over) override {
    accelerations_.forward_dynamics(worker, count, q, qd, tau, a, outcomes, m, B, X, left_over);
  }

  void forward_dynamics(int worker, int count, const double* q, const double* qd, const double* tau,
                        const double* r, double* a, Outcome* outcomes, char* left_over) override {
    if constexpr (!F::at_rest)
      accelerations_.forward_dynamics(worker, count, q, qd, tau, r, a, outcomes, left_over);
    else
      Engine::forward_dynamics(worker, count, q, qd, tau, r, a, outcomes, left_over);
  }

  Outcome inverse(const double* q, double* X) override {
    set_factors(q);
    const double check = inverse_->fill(lowered(), *factors_, X);
    const auto diagonal = [&](int k) { return X[k * (lowered().nv() + std::size_t(1))]; };
    const bool accepted =
        acceptance().accepts_columns(energy_of_columns(*factors_, X)) ||
        acceptance().accepts_all_of(forces_.energy_of_columns(lowered(), *factors_, diagonal));
    return accepted && accepts_factors(check) ? Outcome{} : certified_->inverse(q, X);
  }

  void inverse(int worker, int count, const double* q, double* X, Outcome* outcomes,
               char* left_over) override {
    rows().inverse(worker, count, q, X, outcomes, left_over);
  }

  void solve(int worker, int count, const double* q, const double* tau, double* x,
             Outcome* outcomes, char* left_over) override {
    rows().solve(worker, count, q, tau, x, outcomes, left_over);
  }

  void diagonal(int worker, int count, const double* q, double* x, Outcome* outcomes,
                char* left_over) override {
    rows().diagonal(worker, count, q, x, outcomes, left_over);
  }

  void log_det(int worker, int count, const double* q, double* x, Outcome* outcomes,
               char* left_over) override {
    rows().log_det(worker, count, q, x, outcomes, left_over);
  }

  void selected(int worker, int count, const double* q, double* X, Outcome* outcomes,
                char* left_over) override {
    rows().selected(worker, count, q, X, outcomes, left_over);
  }

  Outcome factor(const double* q) override {
    set_factors(q);
    double check = 0;
    for (const auto& at : factors_->links) check += at.inverse_D * 0;
    by_certified_ = !accepts_factors(check);
    if (by_certified_) return certified_->factor(q);
    certified_->keep(q);
    return {};
  }

  Outcome solve(int columns, const double* taus, double* X) override {
    if (by_certified_) return certified_->solve(columns, taus, X);
    Outcome out;
    solve_columns(*factors_, columns, taus, X, [&](std::ptrdiff_t at) {
      out = worse(out, certified_->column(taus + at, X + at));
    });
    return out;
  }

  Outcome diagonal(const double* q, double* x) override {
    set_factors(q);
    const double check = diagonal_->fill(lowered(), *factors_, x);
    return accepts_factors(check) ? Outcome{} : certified_->diagonal(q, x);
  }

  Outcome log_det(const double* q, double& x) override {
    set_factors(q);
    x = kalmarm::log_det(*factors_);
    return accepts_factors(x * 0) ? Outcome{} : certified_->log_det(q, x);
  }

  Outcome selected(const double* q, double* X) override {
    set_factors(q);
    const double check = selected_.fill(lowered(), *factors_, X);
    return accepts_factors(check) ? Outcome{} : certified_->selected(q, X);
  }

  // The certified form has no derivatives: it says whether M
  // is singular. Where a D may be wrong by 1 per cent, they warn.
  Outcome derivatives(const double* q, const double* qd, const double* tau, double* da_dq,
                      double* da_dqd, double* da_dtau, double* a) override {
    set_derivatives(q, qd, tau, da_dq, da_dqd, da_dtau, a);
    const RoundingLoss loss = loss_of_derivatives(q);
    const bool finite = terms().check == 0;
    if (finite && loss.bound < lowered().error_of_D()) return {};
    const Outcome out = certified_->factor(q);
    if (out && !finite) return {.status = Outcome::Status::not_finite};
    return out ? of_derivatives(out, loss) : out;
  }

 private:
  // What answers the rows of a worker that its lanes have left over.
  struct Climb {
    CertifiedAnswer certified;
    std::vector<char> left_over;

    Climb(const RobotModel& robot, const LoweredModel<double>& model, const EngineOptions& options,
          bool at_rest)
        : certified(robot, model, options, at_rest) {}
  };

  // X = M^-1 taus by factors that are kept or that a sweep has left; climb(where it starts) of every
  // column that is not accepted.
  template <class Factors, class Use>
  void solve_columns(const Factors& factors, int columns, const double* taus, double* X,
                     const Use& climb) {
    const std::ptrdiff_t nv = lowered().nv();
    constexpr int lanes = FactorSolver<double>::lanes;
    for (int first = 0; first < columns; first += lanes) {
      const int left = columns - first, count = std::min(left, lanes);
      const std::ptrdiff_t start = first * nv;
      const auto sums = solver_->solve(lowered(), factors, count, left, taus + start, X + start);
      for (int j = 0; j < count; ++j)
        if (!(factors.margin > 0 && acceptance().accepts(sums, j))) climb(start + j * nv);
    }
  }

  void set_factors(const double* q) { covariance_factor(lowered(), q, *factors_); }
  // Whether the factors, and what was made of them, can be used. check: zero where all of it is finite.
  bool accepts_factors(double check) const { return check == 0 && factors_->margin > 0; }

  RobotModel robot_;
  AccelerationRows<double, F> accelerations_;
  ForceNoise<double> forces_;
  std::optional<CertifiedAnswer> certified_;
  std::vector<Climb> climbs_;  // of every worker
  std::optional<typename F::template Workspace<double>> one_;
  std::optional<FastFactors<double>> factors_;
  std::optional<InverseColumns<double>> inverse_;
  std::optional<FactorSolver<double>> solver_;
  std::optional<InverseDiagonal<double>> diagonal_;
  SelectedColumns<double> selected_;
  bool by_certified_ = false;  // the factors that are kept
};

}  // namespace kalmarm
