// Factors of M, M^-1 and parts of it whose error is known: by the conventional form, judged by a
// probe (probe.hpp); where that is not enough, or some D may be lost in rounding, in DoubleDouble
// (wide_factors.hpp), which warns or refuses where it cannot tell D from rounding.
//   enough, of what is not refined:  64 u;     of factors for solves, which are: 1e-3
// Solves are refined with the residual in twice the precision (refine.hpp).
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_acceleration.hpp"
#include "algorithms/fast/certified/probe.hpp"
#include "algorithms/fast/certified/wide_factors.hpp"
#include "algorithms/fast/engine.hpp"
#include "algorithms/fast/factors/log_det.hpp"

namespace kalmarm {

// Of numbers in double.
class CertifiedFactors {
 public:
  CertifiedFactors(const CertifiedModels<double>& models, const EngineOptions& options)
      : models_(models),
        factors_(models.lowered),
        solver_(models.lowered),
        probe_(models.lowered, models.twice),
        second_(models.lowered),
        refiner_(models.lowered.nv(), 0),
        bounded_(models.lowered),
        wide_(models.robot, options),
        q_(models.lowered.nq()) {
    if (options.wants(Want::inverse)) inverse_.emplace(models.lowered);
    if (options.wants(Want::diagonal)) lambda_.emplace(models.lowered);
    if (options.selection.size() == 0) return;
    selected_.select(models.lowered, options.selection);
  }

  Outcome inverse(const double* q, double* X) {
    const int nv = models_.lowered.nv();
    return by_best(
        q, fine,
        [&] {
          inverse_->fill(models_.lowered, factors_, X);
          return [X, nv](const double* s, double* y) { times(nv, X, s, y); };
        },
        [&] { return wide_.inverse(q, X); });
  }

  Outcome diagonal(const double* q, double* x) {
    return by_factors(
        q, fine, [&] { return wide_.diagonal(q, x); },
        [&] {
          fast_lambda(models_.lowered, factors_, *lambda_);
          std::copy_n(lambda_->alpha.data(), models_.lowered.nv(), x);
        });
  }

  Outcome log_det(const double* q, double& x) {
    return by_factors(
        q, fine, [&] { return wide_.log_det(q, x); }, [&] { x = kalmarm::log_det(factors_); });
  }

  Outcome selected(const double* q, double* X) {
    return by_factors(
        q, fine, [&] { return wide_.selected(q, X); },
        [&] { selected_.fill(models_.lowered, factors_, X); });
  }

  // Factors that are kept, for solve.
  Outcome factor(const double* q) {
    std::copy_n(q, q_.size(), q_.data());
    by_wide_ = false;
    return kept_ = by_factors(
               q, 1e-3,
               [&] {
                 by_wide_ = true;
                 return wide_.factor(q);
               },
               [] {});
  }

  // By the factors that are kept, which are right: their outcome, with the error of the worst
  // column. A column that does not settle is answered in DoubleDouble.
  Outcome solve(int columns, const double* taus, double* X) {
    const int nv = models_.lowered.nv();
    Outcome out = kept_;
    if (by_wide_) {
      return suspect(wide_.solve(columns, taus, X));
    }
    out.error = 0;
    std::optional<Outcome> wide;  // factors for columns that do not settle
    const auto by_kept = bounded_.on(models_.lowered, factors_);
    for (int j = 0; j < columns; ++j) {
      const std::ptrdiff_t start = std::ptrdiff_t(j) * nv;
      by_kept.solve(taus + start, X + start);
      if (!all_finite(nv, taus + start)) continue;
      probe_.residual().set_torque(taus + start);
      Verdict refined;
      refiner_.refine(models_.twice, probe_.residual(), by_kept, 1, X + start, &refined);
      out.steps = std::max(out.steps, refined.steps);
      if (refined.settled) {
        out.error = std::max(out.error, refined.error);
        continue;
      }
      if (!wide) wide = wide_.factor(q_.data());
      out = worse(out, suspect(*wide ? wide_.solve(1, taus + start, X + start) : *wide));
    }
    return !out || all_finite(std::ptrdiff_t(columns) * nv, X)
               ? out
               : Outcome{.status = Outcome::Status::not_finite};
  }

 private:
  static constexpr double fine = 64 * 0x1p-53;

  static void times(int nv, const double* X, const double* s, double* y) {
    Eigen::Map<VectorX<double>>(y, nv).noalias() =
        Eigen::Map<const MatrixX<double>>(X, nv, nv) * Eigen::Map<const VectorX<double>>(s, nv);
  }

  // By factors whose probe, of what work() returns, is enough; else by last().
  template <class Work, class Last>
  Outcome by_best(const double* q, double enough, const Work& work, const Last& last) {
    if (!all_finite(models_.lowered.nq(), q)) return {.status = Outcome::Status::not_finite};
    covariance_factor(models_.lowered, q, factors_);
    if (factors_.margin > 0 ||
        second_.error_of_D(models_.lowered, q, factors_, 0) < largest_error_of_D) {
      const auto answer = work();
      probe_.set(models_.twice, factors_, q);
      Outcome out;
      out.error = probe_.error(models_.lowered, models_.twice, factors_, solver_, answer);
      if (out.error <= enough) return out;
    }
    return suspect(last());
  }

  static Outcome suspect(Outcome out) {
    out.suspect = static_cast<bool>(out);
    return out;
  }

  // The probe is of the factors' own solution, and then read() reads them.
  template <class Last, class Read>
  Outcome by_factors(const double* q, double enough, const Last& last, const Read& read) {
    bool left = false;
    const Outcome out = by_best(
        q, enough,
        [&] {
          return [&](const double* s, double* y) {
            solver_.solve(models_.lowered, factors_, 1, s, y);
          };
        },
        [&] {
          left = true;
          return last();
        });
    if (!left && out) read();
    return out;
  }

  const CertifiedModels<double>& models_;
  FastFactors<double> factors_;
  FactorSolver<double> solver_;
  Probe<detail::Carrier<double>> probe_;
  CovarianceForm::Second<double> second_;
  Refiner<double> refiner_;
  BoundedSolve<double> bounded_;
  WideFactors wide_;
  std::optional<InverseColumns<double>> inverse_;
  std::optional<LambdaWorkspace<double>> lambda_;
  SelectedColumns<double> selected_;
  std::vector<double> q_;  // of the factors that are kept
  Outcome kept_;           // of them
  bool by_wide_ = false;   // they are
};

}  // namespace kalmarm
