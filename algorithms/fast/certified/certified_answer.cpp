#include "algorithms/fast/certified/certified_answer.hpp"

#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_factors.hpp"

namespace kalmarm {

struct CertifiedAnswer::Parts {
  CertifiedModels models;
  std::optional<CertifiedAcceleration> acceleration;
  std::optional<CertifiedFactors> factors;
  std::vector<double> kept_q;       // of columns
  std::optional<Outcome> kept;      // of factors there
  std::vector<double> no_velocity;  // (nv) of robots at rest, else empty

  Parts(const RobotModel& robot, const LoweredModel<double>& lowered, const EngineOptions& options,
        bool at_rest)
      : models(lowered, robot, options.tolerance),
        kept_q(lowered.nq()),
        no_velocity(at_rest ? lowered.nv() : 0, 0.0) {
    if (options.wants(Want::acceleration)) acceleration.emplace(models);
    if (options.wants_factors() || options.wants(Want::derivatives))
      factors.emplace(models, options);
  }
};

CertifiedAnswer::CertifiedAnswer(const RobotModel& robot, const LoweredModel<double>& lowered,
                                 const EngineOptions& options, bool at_rest)
    : parts_(std::make_unique<Parts>(robot, lowered, options, at_rest)) {}

CertifiedAnswer::CertifiedAnswer(CertifiedAnswer&&) noexcept = default;
CertifiedAnswer::~CertifiedAnswer() = default;

namespace {

Outcome recomputed(Outcome out) {
  out.recomputed = static_cast<bool>(out);
  return out;
}

}  // namespace

Outcome CertifiedAnswer::acceleration(const double* q, const double* qd, const double* tau,
                                      double* a) {
  Parts& parts = *parts_;
  const double* const moving = parts.no_velocity.empty() ? qd : parts.no_velocity.data();
  return recomputed(parts.acceleration->acceleration(parts.models, q, moving, tau, a));
}

Outcome CertifiedAnswer::inverse(const double* q, double* X) {
  return recomputed(parts_->factors->inverse(q, X));
}

Outcome CertifiedAnswer::factor(const double* q) { return recomputed(parts_->factors->factor(q)); }

Outcome CertifiedAnswer::solve(int columns, const double* taus, double* X) {
  return recomputed(parts_->factors->solve(columns, taus, X));
}

Outcome CertifiedAnswer::diagonal(const double* q, double* x) {
  return recomputed(parts_->factors->diagonal(q, x));
}

Outcome CertifiedAnswer::log_det(const double* q, double& x) {
  return recomputed(parts_->factors->log_det(q, x));
}

Outcome CertifiedAnswer::selected(const double* q, double* X) {
  return recomputed(parts_->factors->selected(q, X));
}

void CertifiedAnswer::keep(const double* q) {
  Parts& parts = *parts_;
  std::copy_n(q, parts.kept_q.size(), parts.kept_q.data());
  parts.kept.reset();
}

Outcome CertifiedAnswer::column(const double* tau, double* x) {
  Parts& parts = *parts_;
  if (!all_finite(parts.models.lowered.nv(), tau)) return {.status = Outcome::Status::not_finite};
  if (!parts.kept) parts.kept = factor(parts.kept_q.data());
  return *parts.kept ? solve(1, tau, x) : *parts.kept;
}

}  // namespace kalmarm
