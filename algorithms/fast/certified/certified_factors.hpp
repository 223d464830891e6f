// Factors of M, M^-1 and parts of it whose error is known: by the conventional form, judged by
// probes (probe.hpp); where that is not enough, or some D may be lost in rounding, in DoubleDouble
// (wide_factors.hpp), which warns or refuses where it cannot tell D from rounding.
//   enough, of what is not refined:  64 u sqrt(nv);     of factors for solves, which are: 1e-3
//   error of them all:               at least 4 u, since eight probes may miss an error of one entry
// Solves are refined with the residual in twice the precision (refine.hpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_acceleration.hpp"
#include "algorithms/fast/certified/probe.hpp"
#include "algorithms/fast/certified/wide_factors.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/factors/diagonal.hpp"
#include "algorithms/fast/factors/log_det.hpp"

namespace kalmarm {

class CertifiedFactors {
 public:
  CertifiedFactors(const CertifiedModels& models, const EngineOptions& options)
      : models_(models),
        factors_(models.lowered),
        probes_(models.lowered, models.twice),
        residual_(models.twice),
        second_(models.lowered),
        refiner_(models.lowered.nv(), 0),
        bounded_(models.lowered),
        wide_(models.robot, options),
        q_(models.lowered.nq()) {
    if (options.wants(Want::inverse)) inverse_.emplace(models.lowered);
    if (options.wants(Want::diagonal))
      diagonal_.emplace(models.lowered, InverseDiagonal<double>::Terms::positive);
    if (options.selection.size() == 0) return;
    selected_.select(models.lowered, options.selection);
  }

  Outcome inverse(const double* q, double* X) {
    return by_best(
        q, fine(),
        [&](double error_of_D) {
          inverse_->fill(models_.lowered, factors_, X);
          return probes_.of_matrix(models_.lowered, models_.twice, factors_, X, error_of_D);
        },
        [&] { return wide_.inverse(q, X); });
  }

  Outcome diagonal(const double* q, double* x) {
    return by_factors(
        q, fine(), [&] { return wide_.diagonal(q, x); },
        [&](Outcome&) { diagonal_->fill(models_.lowered, factors_, x); });
  }

  // Its error is told beside |log det M| where that is above 1: log_det.hpp has what it rounds.
  Outcome log_det(const double* q, double& x) {
    return by_factors(
        q, fine(), [&] { return wide_.log_det(q, x); },
        [&](Outcome& out) {
          x = kalmarm::log_det(factors_);
          const double of_sum = 0x1p-54 * models_.lowered.nv();
          out.error = (root_of_nv() * out.error + of_sum) / std::max(1.0, std::abs(x));
        });
  }

  Outcome selected(const double* q, double* X) {
    return by_factors(
        q, fine(), [&] { return wide_.selected(q, X); },
        [&](Outcome&) { selected_.fill(models_.lowered, factors_, X); });
  }

  // Factors that are kept, for solve.
  Outcome factor(const double* q) {
    std::copy_n(q, q_.size(), q_.data());
    by_wide_ = false;
    return kept_ = by_factors(
               q, enough_of_factors,
               [&] {
                 by_wide_ = true;
                 return wide_.factor(q);
               },
               [&](Outcome&) { residual_.set_mass(models_.twice, q); });
  }

  // By the factors that are kept, which are right: their outcome, with the error of the worst
  // column. A column that does not settle is answered in DoubleDouble.
  Outcome solve(int columns, const double* taus, double* X) {
    const int nv = models_.lowered.nv();
    Outcome out = kept_;
    if (by_wide_) return by_two_doubles(wide_.solve(columns, taus, X));
    out.error = 0;
    std::optional<Outcome> wide;  // factors for columns that do not settle
    const auto by_kept = bounded_.on(models_.lowered, factors_);
    for (int j = 0; j < columns; ++j) {
      const std::ptrdiff_t start = std::ptrdiff_t(j) * nv;
      by_kept.solve(taus + start, X + start);
      if (!all_finite(nv, taus + start)) continue;
      residual_.set_torque(taus + start);
      Verdict refined;
      refiner_.refine(models_.twice, residual_, by_kept, 1, X + start, &refined, kept_.error);
      out.steps = std::max(out.steps, refined.steps);
      if (refined.settled) {
        out.error = std::max(out.error, refined.error);
        continue;
      }
      if (!wide) wide = wide_.factor(q_.data());
      out = worse(out, by_two_doubles(*wide ? wide_.solve(1, taus + start, X + start) : *wide));
    }
    return !out || all_finite(std::ptrdiff_t(columns) * nv, X)
               ? out
               : Outcome{.status = Outcome::Status::not_finite};
  }

 private:
  double root_of_nv() const { return std::sqrt(static_cast<double>(models_.lowered.nv())); }
  double fine() const { return enough_of_parts * 0x1p-53 * root_of_nv(); }

  // By factors of which, or of what is made of them, error(eps) is enough, with eps the error of a
  // D; else by last().
  template <class Error, class Last>
  Outcome by_best(const double* q, double enough, const Error& error, const Last& last) {
    if (!all_finite(models_.lowered.nq(), q)) return {.status = Outcome::Status::not_finite};
    covariance_factor(models_.lowered, q, factors_);
    const double of_D =
        factors_.margin > 0 ? models_.lowered.error_of_D() : second_.look(models_.lowered, q).bound;
    if (of_D < error_of_D_to_refine) {
      probes_.set_position(models_.twice, q);
      Outcome out;
      out.rung = Outcome::Rung::refined;
      out.error = std::max(error(of_D), least_error_of_parts * 0x1p-53);
      if (out.error <= enough) return out;
    }
    return by_two_doubles(last());
  }

  static Outcome by_two_doubles(Outcome out) {
    out.rung = Outcome::Rung::two_doubles;
    return out;
  }

  // The probes are of the factors, and then read(outcome) reads them.
  template <class Last, class Read>
  Outcome by_factors(const double* q, double enough, const Last& last, const Read& read) {
    bool left = false;
    Outcome out = by_best(
        q, enough,
        [&](double) { return probes_.of_factors(models_.lowered, models_.twice, factors_); },
        [&] {
          left = true;
          return last();
        });
    if (!left && out) read(out);
    return out;
  }

  const CertifiedModels& models_;
  FastFactors<double> factors_;
  Probes probes_;
  TwiceResidual<double> residual_;  // of the factors that are kept
  RoundingBound<double> second_;
  Refiner<double> refiner_;
  BoundedSolve<double> bounded_;
  WideFactors wide_;
  std::optional<InverseColumns<double>> inverse_;
  std::optional<InverseDiagonal<double>> diagonal_;
  SelectedColumns<double> selected_;
  std::vector<double> q_;  // of the factors that are kept
  Outcome kept_;           // of them
  bool by_wide_ = false;   // they are
};

}  // namespace kalmarm
