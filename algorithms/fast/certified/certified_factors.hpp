// Factors of M, M^-1 and parts of it whose error is known: by the conventional form, whose D are right to eps by
// rounding_bound.hpp, so that M of the factors is within 1 +- eps of M in the order of positive semidefinite
// matrices. With S of (11) of force_noise.hpp,
//   |error of M^-1(i,j)| <= (eps + c u sqrt(S)) sqrt(M^-1(i,i) M^-1(j,j)),   |error of log det M| <= nv eps   (1)
// of which the first holds of J M^-1 J' too. Where that is above what the tolerance asks, in DoubleDouble
// (wide_factors.hpp), which warns or refuses where it cannot tell D from rounding. Solves are refined with
// the residual in twice the precision (refine.hpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_acceleration.hpp"
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
        residual_(models.twice),
        bound_(models.lowered),
        forces_(models.lowered),
        refiner_(models.lowered.nv(), 0),
        bounded_(models.lowered),
        wide_(models.robot, options),
        width_(models.lowered.widths()),
        at_(width_) {
    if (options.wants(Want::inverse)) inverse_.emplace(models.lowered);
    if (options.wants(Want::diagonal))
      diagonal_.emplace(models.lowered, InverseDiagonal<double>::Terms::positive);
    if (options.selection.size() == 0) return;
    selected_.select(models.lowered, options.selection);
  }

  Outcome inverse(const Call<double>& call) {
    const std::size_t nv = models_.lowered.nv();
    double* const X = call.out;
    return by_factors(
        call, [&] { return wide_.inverse(call); },
        [&] {
          const double check = inverse_->fill(models_.lowered, factors_, X);
          return check + error_of_columns([&](int k) { return X[k * (nv + 1)]; });
        });
  }

  Outcome diagonal(const Call<double>& call) {
    return by_factors(
        call, [&] { return wide_.diagonal(call); },
        [&] {
          const double check = diagonal_->fill(models_.lowered, factors_, call.out);
          return check + error_of_columns([&](int k) { return call.out[k]; });
        });
  }

  // Its error is told beside |log det M| where that is above 1: log_det.hpp has what it rounds.
  Outcome log_det(const Call<double>& call) {
    return by_factors(
        call, [&] { return wide_.log_det(call); },
        [&] {
          const double x = *call.out = kalmarm::log_det(factors_);
          const double rounded = unit_roundoff<double>() / 2;
          return x * 0 +
                 models_.lowered.nv() * (error_of_D_ + rounded) / std::max(1.0, std::abs(x));
        });
  }

  // v(k) of (4) of force_noise.hpp stands for M^-1(k,k), which is not known.
  Outcome selected(const Call<double>& call, double* X) {
    return by_factors(
        call, [&] { return wide_.selected(call, X); },
        [&] {
          const double check = selected_.answer(Want::operational, models_.lowered, factors_, X);
          forces_.trace(models_.lowered, factors_);
          return check + error_of_columns([&](int k) { return forces_.variance(k); });
        });
  }

  // Factors that are kept, for solves, which say how wrong they are.
  Outcome factor(const Call<double>& call) {
    at_.keep(call);
    if (!finite(call)) return kept_ = {.status = Outcome::Status::not_finite};
    by_wide_ = !set_factors(call);
    if (by_wide_) return kept_ = by_two_doubles(wide_.factor(call));
    residual_.set_mass(models_.twice, call.q, contacts_of(call));
    return kept_ = refined(Outcome{}.error);
  }

  // By the factors that are kept, which are right: their outcome, with the error of the worst
  // column. A column that does not settle is answered in DoubleDouble.
  Outcome solve(int columns, const double* taus, double* X) {
    const int nv = models_.lowered.nv();
    Outcome out = kept_;
    if (by_wide_) return by_two_doubles(wide_.solve(columns, taus, X));
    out.error = 0;
    std::optional<Outcome> wide;  // factors for columns that do not settle
    const auto by_kept = [&](const double* r, double* d) {
      return bounded_.solve(models_.lowered, factors_, error_of_D_, r, d);
    };
    for (int j = 0; j < columns; ++j) {
      const std::ptrdiff_t start = std::ptrdiff_t(j) * nv;
      by_kept(taus + start, X + start);
      if (!all_finite(nv, taus + start)) continue;
      residual_.set_torque(taus + start);
      RefinedAnswer refined;
      refiner_.refine(models_.twice, residual_, by_kept, 1, X + start, &refined);
      out.steps = std::max(out.steps, refined.steps);
      if (refined.settled && refined.error <= accepted_error_refined(models_.tolerance)) {
        out.error = std::max(out.error, refined.error);
        continue;
      }
      if (!wide) wide = wide_.factor(at_.call());
      out = worse(out, by_two_doubles(*wide ? wide_.solve(1, taus + start, X + start) : *wide));
    }
    return !out || all_finite(std::ptrdiff_t(columns) * nv, X)
               ? out
               : Outcome{.status = Outcome::Status::not_finite};
  }

 private:
  bool finite(const Call<double>& call) const {
    return all_finite(width_.nq, call.q) &&
           (!call.contacts || all_finite(width_.c, call.contacts)) &&
           (!call.loads || all_finite(width_.l, call.loads));
  }

  // Whether the factors at a finite position are right to a digit or two.
  bool set_factors(const Call<double>& call) {
    const Acting<double> contacts = contacts_of(call);
    covariance_factor(models_.lowered, call.q, factors_, contacts);
    error_of_D_ = bound_.look(models_.lowered, call.q, contacts).bound;
    if (call.contacts) error_of_D_ += error_of_contacts(models_.lowered, factors_);
    return error_of_D_ < largest_error_of_D;
  }

  // What read() makes of the factors, where the error that it returns is accepted, which NaN is not; else
  // last().
  template <class Last, class Read>
  Outcome by_factors(const Call<double>& call, const Last& last, const Read& read) {
    if (!finite(call)) return {.status = Outcome::Status::not_finite};
    if (set_factors(call))
      if (const double error = read(); error <= accepted_error_of_parts(models_.tolerance))
        return refined(error);
    return by_two_doubles(last());
  }

  // (1); diagonal(k): M^-1(k,k).
  template <class Diagonal>
  double error_of_columns(const Diagonal& diagonal) {
    const double S = forces_.energy_of_columns(models_.lowered, factors_, diagonal);
    return error_of_D_ + rounding_constant * unit_roundoff<double>() * std::sqrt(S);
  }

  static Outcome refined(double error) {
    Outcome out;
    out.rung = Outcome::Rung::refined;
    out.error = error;
    return out;
  }

  static Outcome by_two_doubles(Outcome out) {
    out.rung = Outcome::Rung::two_doubles;
    return out;
  }

  const CertifiedModels& models_;
  FastFactors<double> factors_;
  double error_of_D_ = 0;           // eps of (1), of these factors
  TwiceResidual<double> residual_;  // of the factors that are kept
  RoundingBound<double> bound_;
  ForceNoise<double> forces_;
  Refiner<double> refiner_;
  BoundedSolve<double> bounded_;
  WideFactors wide_;
  std::optional<InverseColumns<double>> inverse_;
  std::optional<InverseDiagonal<double>> diagonal_;
  SelectedColumns<double> selected_;
  Widths width_;
  KeptPosition<double> at_;  // of the factors that are kept
  Outcome kept_;             // of them
  bool by_wide_ = false;     // they are
};

}  // namespace kalmarm
