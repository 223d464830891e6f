// One state after another by the kernels in double on 6-D vectors and the sweep F (forms.hpp). An answer
// whose sums say that it can be used (engine/acceptance.hpp) is the kernel's own; any other is refined
// (certified_answer.hpp), and where the tolerance asks for it all are.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "algorithms/fast/factors/log_det.hpp"
#include "algorithms/fast/ladder/rigid_state.hpp"

namespace kalmarm {

template <class F>
class SpatialState : public RigidState {
 public:
  SpatialState(ModelsInDouble& models, const EngineOptions& options)
      : RigidState(models, options), forces_(lowered()) {
    const auto wants = [&](Want want) { return options.wants(want); };
    if (wants(Want::acceleration) || options.wants_factors() || wants(Want::derivatives))
      certified_.emplace(models.certified(), options, F::at_rest);
    if (wants(Want::acceleration)) sweep_.emplace(lowered());
    if (options.wants_factors()) factors_.emplace(lowered());
    if (wants(Want::inverse)) inverse_.emplace(lowered(), options.triangles);
    if (wants(Want::solve)) solver_.emplace(lowered());
    if (wants(Want::diagonal)) diagonal_.emplace(lowered(), InverseDiagonal<double>::Terms::fewest);
    if (options.selection.size() > 0) selected_.select(lowered(), options.selection);
  }

  bool takes_lanes(Want want) const {
    return !models().refined || want == Want::mass || want == Want::inverse_dynamics;
  }

  void reserve_rows(Want want) {
    if (want == Want::acceleration) certified_->reserve_rows();
  }

  void answer_rows(int count, const Call<double>& call, Outcome* outcomes, const char* left_over) {
    if (std::find(left_over, left_over + count, char(1)) == left_over + count) return;
    if (call.want == Want::acceleration && !call.B && !call.r)
      return certified_->answer_rows(count, call, outcomes, left_over);
    one_by_one(*this, count, call, outcomes, left_over);
  }

  // With joint noise: what lanes have left over, and no sweep here can answer.
  Outcome acceleration(const Call<double>& call) {
    if (models().refined || call.r) return certified_->answer(call);
    F::acceleration(lowered(), call.q, call.qd, call.tau, *sweep_, call.out, forces_of(call));
    const auto by = acceptance().judge(F::sums(*sweep_));
    if (acceptance().accepts(sweep_->margin, by, 0)) return {.error = by.error};
    return certified_->answer(call, &*sweep_);
  }

  // X = M^-1 B by the factors of the same sweep, where it is accepted and all columns are.
  Outcome with_columns(const Call<double>& call) {
    const Outcome of_a = acceleration(call);
    if (!of_a) return of_a;
    if (of_a.rung == Outcome::Rung::float64) {
      bool by_sweep = true;
      solve_columns(*sweep_, call.m, call.B, call.X, [&](std::ptrdiff_t) { by_sweep = false; });
      if (by_sweep) return of_a;
    }
    const Outcome of_D = factor(call);
    return of_D ? worse(of_a, worse(of_D, solve(call.m, call.B, call.X))) : of_D;
  }

  // What is made of factors alone.
  Outcome by_factors(const Call<double>& call) {
    if (models().refined) return certified_->answer(call);
    set_factors(call);
    double check = 0;
    bool accepted = true;
    switch (call.want) {
      case Want::inverse:
        check = inverse_->fill(lowered(), *factors_, call.out);
        accepted = accepts_columns(call.out);
        break;
      case Want::diagonal:
        check = diagonal_->fill(lowered(), *factors_, call.out);
        break;
      case Want::log_det:
        *call.out = kalmarm::log_det(*factors_);
        check = *call.out * 0;
        break;
      default:
        check = selected_.answer(call.want, lowered(), *factors_, call.out);
    }
    return accepted && accepts_factors(check) ? Outcome{} : certified_->answer(call);
  }

  // Refinement has no derivatives: it gives their a, or says whether M is singular. Where a D may be
  // wrong by 1 per cent, they warn.
  Outcome differentiate(const Call<double>& call) {
    const bool finite = derivatives(call);
    const RoundingLoss loss = loss_of_derivatives(call);
    if (!models().refined && finite && loss.bound < lowered().error_of_D()) return {};
    const Outcome out = models().refined ? certified_->answer(call) : certified_->factor(call);
    if (out && !finite) return {.status = Outcome::Status::not_finite};
    return out ? of_derivatives(out, loss) : out;
  }

  Outcome factor(const Call<double>& call) {
    by_certified_ = models().refined;
    if (!by_certified_) {
      set_factors(call);
      double check = 0;
      for (const auto& at : factors_->links) check += at.inverse_D * 0;
      by_certified_ = !accepts_factors(check);
    }
    if (by_certified_) return certified_->factor(call);
    certified_->keep(call);
    return {};
  }

  Outcome solve(int columns, const double* taus, double* X) {
    if (by_certified_) return certified_->solve(columns, taus, X);
    Outcome out;
    solve_columns(*factors_, columns, taus, X, [&](std::ptrdiff_t at) {
      out = worse(out, certified_->column(taus + at, X + at));
    });
    return out;
  }

 private:
  bool accepts_columns(const double* X) {
    const auto diagonal = [&](int k) { return X[k * (lowered().nv() + std::size_t(1))]; };
    return acceptance().accepts_columns(energy_of_columns(*factors_, X)) ||
           acceptance().accepts_all_of(forces_.energy_of_columns(lowered(), *factors_, diagonal));
  }

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

  void set_factors(const Call<double>& call) {
    covariance_factor(lowered(), call.q, *factors_, contacts_of(call));
  }
  // Whether the factors, and what was made of them, can be used. check: zero where all of it is finite.
  bool accepts_factors(double check) const { return check == 0 && factors_->margin > 0; }

  ForceNoise<double> forces_;
  std::optional<CertifiedAnswer> certified_;
  std::optional<typename F::template Workspace<double>> sweep_;
  std::optional<FastFactors<double>> factors_;
  std::optional<InverseColumns<double>> inverse_;
  std::optional<FactorSolver<double>> solver_;
  std::optional<InverseDiagonal<double>> diagonal_;
  SelectedColumns<double> selected_;
  bool by_certified_ = false;  // the factors that are kept
};

}  // namespace kalmarm
