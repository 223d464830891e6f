// Certified answers in float by factors in double (certified_factors.hpp): M^-1 by the columns of
// float on rounded factors of the conventional form, judged by probes whose residual is in double;
// enough is 64 u sqrt(nv). Where that is not reached, and for all else, the answer is double's, rounded.
#pragma once

#include "algorithms/fast/certified/certified_factors.hpp"

namespace kalmarm {

// M^-1 of numbers in float, from factors in double.
class CertifiedNarrowInverse {
 public:
  explicit CertifiedNarrowInverse(const CertifiedModels<float>& models)
      : factors_(models.twice),
        probes_(models.twice, models.twice),
        narrow_(models.lowered),
        inverse_(models.lowered),
        second_(models.twice),
        q_(models.lowered.nq()) {}

  // Not settled: X is not to be used.
  Verdict inverse(const CertifiedModels<float>& models, const float* q, float* X) {
    const int nv = models.lowered.nv();
    std::copy_n(q, q_.size(), q_.data());
    covariance_factor(models.twice, q_.data(), factors_);
    Verdict out;
    const double of_D = factors_.margin > 0
                            ? error_of_D_let_pass<double>
                            : second_.error_of_D(models.twice, q_.data(), factors_, 0);
    if (!(of_D < error_of_D_to_refine)) return out;
    round_factors(nv);
    inverse_.fill(models.lowered, narrow_, X);
    probes_.set_position(models.twice, q_.data());
    out.error = probes_.of_matrix(models.twice, models.twice, factors_, X, of_D);
    out.settled = out.error <= enough_of_parts * 0x1p-24 * std::sqrt(static_cast<double>(nv));
    return out;
  }

 private:
  static void round(const Sixfold<double>& from, Sixfold<float>& to) {
    to = {float(from.x), float(from.y), float(from.z), float(from.u), float(from.v), float(from.w)};
  }

  void round_factors(int nv) {
    std::transform(factors_.sin.begin(), factors_.sin.end(), narrow_.sin.begin(), to_float);
    std::transform(factors_.cos.begin(), factors_.cos.end(), narrow_.cos.begin(), to_float);
    for (std::size_t i = 0; i < factors_.matrices.size(); ++i)
      for (int a = 0; a < 3; ++a) {
        narrow_.matrices[i].p[a] = to_float(factors_.matrices[i].p[a]);
        for (int b = 0; b < 3; ++b)
          narrow_.matrices[i].R.R[a][b] = to_float(factors_.matrices[i].R.R[a][b]);
      }
    for (int k = 0; k < nv; ++k) {
      const auto& from = factors_.links[k];
      auto& to = narrow_.links[k];
      to.d = to_float(from.d);
      to.inverse_D = to_float(from.inverse_D);
      round(from.g, to.g);
    }
  }

  static float to_float(double x) { return static_cast<float>(x); }

  FastFactors<double> factors_;
  Probes<detail::SameCarrier> probes_;
  FastFactors<float> narrow_;
  InverseColumns<float> inverse_;
  CovarianceForm::SecondLook<double> second_;
  std::vector<double> q_;
};

class CertifiedNarrowFactors {
 public:
  CertifiedNarrowFactors(const CertifiedModels<float>& models, const EngineOptions& options)
      : models_(models),
        wide_models_(models.twice, model_of(models.robot)),
        wide_(wide_models_, options),
        selected_(options.selection.size()),
        q_(models.lowered.nq()),
        tau_(models.lowered.nv()),
        X_(std::max(std::size_t(nv()), std::size_t(selected_) * selected_)) {
    if (!options.wants(Want::inverse)) return;
    narrow_.emplace(models);
    X_.resize(std::max(X_.size(), std::size_t(nv()) * nv()));
  }

  Outcome inverse(const float* q, float* X) {
    const Verdict narrow = narrow_->inverse(models_, q, X);
    if (narrow.settled) return outcome_of(narrow);
    return rounded(wide_.inverse(wide(q), X_.data()), std::size_t(nv()) * nv(), X_.data(), X);
  }

  Outcome diagonal(const float* q, float* x) {
    return rounded(wide_.diagonal(wide(q), X_.data()), nv(), X_.data(), x);
  }

  Outcome log_det(const float* q, float& x) {
    double wide_x = 0;
    return rounded(wide_.log_det(wide(q), wide_x), 1, &wide_x, &x);
  }

  Outcome selected(const float* q, float* X) {
    return rounded(wide_.selected(wide(q), X_.data()), std::size_t(selected_) * selected_,
                   X_.data(), X);
  }

  Outcome factor(const float* q) { return wide_.factor(wide(q)); }

  Outcome solve(int columns, const float* taus, float* X) {
    Outcome out = wide_.solve(0, nullptr, nullptr);
    for (std::ptrdiff_t j = 0; j < columns; ++j) {
      std::copy_n(taus + j * nv(), nv(), tau_.data());
      out = worse(out,
                  rounded(wide_.solve(1, tau_.data(), X_.data()), nv(), X_.data(), X + j * nv()));
    }
    return out;
  }

 private:
  int nv() const { return models_.lowered.nv(); }

  const double* wide(const float* q) {
    std::copy_n(q, q_.size(), q_.data());
    return q_.data();
  }

  static Outcome rounded(Outcome out, std::size_t count, const double* from, float* to) {
    std::transform(from, from + count, to, [](double x) { return static_cast<float>(x); });
    if (!out) return out;
    out.error += 0x1p-24;
    return all_finite(static_cast<std::ptrdiff_t>(count), to)
               ? out
               : Outcome{.status = Outcome::Status::not_finite};
  }

  const CertifiedModels<float>& models_;
  CertifiedModels<double> wide_models_;
  CertifiedFactors wide_;
  std::optional<CertifiedNarrowInverse> narrow_;
  int selected_;
  std::vector<double> q_, tau_, X_;
};

template <class S>
using CertifiedFactorsOf =
    std::conditional_t<std::is_same_v<S, double>, CertifiedFactors, CertifiedNarrowFactors>;

}  // namespace kalmarm
