#include "algorithms/fast/certified/certified_answer.hpp"

#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_factors.hpp"
#include "algorithms/fast/certified/certified_rows.hpp"

namespace kalmarm {

std::shared_ptr<const CertifiedModels> make_certified_models(const LoweredModel<double>& lowered,
                                                             const RobotModel& robot,
                                                             const EngineOptions& options) {
  return std::make_shared<const CertifiedModels>(lowered, robot, options);
}

struct CertifiedAnswer::Parts {
  std::shared_ptr<const CertifiedModels> models;
  std::optional<CertifiedAcceleration> acceleration;
  std::optional<CertifiedRows> rows;
  std::optional<CertifiedFactors> factors;
  KeptPosition<double> at;          // of columns
  std::optional<Outcome> kept;      // of factors there
  std::vector<double> no_velocity;  // (nv) of robots at rest, else empty
  MatrixX<double> selected;         // J M^-1 J' where its diagonal is wanted

  Parts(std::shared_ptr<const CertifiedModels> of_robot, const EngineOptions& options, bool at_rest)
      : models(std::move(of_robot)),
        at(models->lowered.widths()),
        no_velocity(at_rest ? models->lowered.nv() : 0, 0.0) {
    const bool derivatives = options.wants(Want::derivatives),
               refined = models->tolerance < least_tolerance_of_double;
    if (options.wants(Want::acceleration) || (derivatives && refined))
      acceleration.emplace(*models);
    if (options.wants_factors() || (derivatives && !refined)) factors.emplace(*models, options);
    const int k = options.wants(Want::operational_diagonal) ? options.selection.size() : 0;
    selected.resize(k, k);
  }

  const double* velocity(const Call<double>& call) const {
    return no_velocity.empty() ? call.qd : no_velocity.data();
  }
};

CertifiedAnswer::CertifiedAnswer(std::shared_ptr<const CertifiedModels> models,
                                 const EngineOptions& options, bool at_rest)
    : parts_(std::make_unique<Parts>(std::move(models), options, at_rest)) {}

CertifiedAnswer::CertifiedAnswer(CertifiedAnswer&&) noexcept = default;
CertifiedAnswer& CertifiedAnswer::operator=(CertifiedAnswer&&) noexcept = default;
CertifiedAnswer::~CertifiedAnswer() = default;

Outcome CertifiedAnswer::answer(const Call<double>& call,
                                const CovarianceWorkspace<double>* swept) {
  Parts& parts = *parts_;
  switch (call.want) {
    case Want::acceleration:
    case Want::derivatives: {
      Call<double> moving = call;
      moving.qd = parts.velocity(call);
      return call.r ? parts.acceleration->last_resort(*parts.models, moving)
                    : parts.acceleration->acceleration(*parts.models, moving, swept);
    }
    case Want::inverse:
      return parts.factors->inverse(call);
    case Want::diagonal:
      return parts.factors->diagonal(call);
    case Want::log_det:
      return parts.factors->log_det(call);
    case Want::operational_diagonal: {
      MatrixX<double>& X = parts.selected;
      const Outcome out = parts.factors->selected(call, X.data());
      Eigen::Map<VectorX<double>>(call.out, X.rows()) = X.diagonal();
      return out;
    }
    default:
      return parts.factors->selected(call, call.out);
  }
}

Outcome CertifiedAnswer::factor(const Call<double>& call) { return parts_->factors->factor(call); }

Outcome CertifiedAnswer::solve(int columns, const double* taus, double* X) {
  return parts_->factors->solve(columns, taus, X);
}

void CertifiedAnswer::reserve_rows() {
  if (!parts_->rows) parts_->rows.emplace(*parts_->models);
}

void CertifiedAnswer::answer_rows(int count, const Call<double>& call, Outcome* outcomes,
                                  const char* left_over) {
  Parts& parts = *parts_;
  Call<double> moving = call;
  if (!parts.no_velocity.empty()) moving.qd = nullptr;
  parts.rows->answer(count, moving, outcomes, left_over, *parts.acceleration);
}

void CertifiedAnswer::keep(const Call<double>& call) {
  parts_->at.keep(call);
  parts_->kept.reset();
}

Outcome CertifiedAnswer::column(const double* tau, double* x) {
  Parts& parts = *parts_;
  if (!all_finite(parts.models->lowered.nv(), tau)) return {.status = Outcome::Status::not_finite};
  if (!parts.kept) parts.kept = factor(parts.at.call());
  return *parts.kept ? solve(1, tau, x) : *parts.kept;
}

}  // namespace kalmarm
