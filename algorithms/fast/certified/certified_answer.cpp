#include "algorithms/fast/certified/certified_answer.hpp"

#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_narrow.hpp"

namespace kalmarm {

template <class S>
struct CertifiedAnswer<S>::Parts {
  CertifiedModels<S> models;
  std::optional<CertifiedAcceleration<S>> acceleration;
  std::optional<CertifiedFactorsOf<S>> factors;
  std::vector<S> no_velocity;  // (nv) of robots at rest, else empty

  Parts(const RobotModel& robot, const LoweredModel<S>& lowered, const EngineOptions& options,
        bool at_rest)
      : models(lowered, model_of(robot).template cast<S>()),
        no_velocity(at_rest ? lowered.nv() : 0, S(0)) {
    if (options.wants(Want::acceleration)) acceleration.emplace(models);
    if (options.wants_factors() || options.wants(Want::derivatives))
      factors.emplace(models, options);
  }
};

template <class S>
CertifiedAnswer<S>::CertifiedAnswer(const RobotModel& robot, const LoweredModel<S>& lowered,
                                    const EngineOptions& options, bool at_rest)
    : parts_(std::make_unique<Parts>(robot, lowered, options, at_rest)) {}

template <class S>
CertifiedAnswer<S>::CertifiedAnswer(CertifiedAnswer&&) noexcept = default;
template <class S>
CertifiedAnswer<S>::~CertifiedAnswer() = default;

namespace {

Outcome recomputed(Outcome out) {
  out.recomputed = static_cast<bool>(out);
  return out;
}

}  // namespace

template <class S>
Outcome CertifiedAnswer<S>::acceleration(const S* q, const S* qd, const S* tau, S* a) {
  Parts& parts = *parts_;
  const S* const moving = parts.no_velocity.empty() ? qd : parts.no_velocity.data();
  return recomputed(parts.acceleration->acceleration(parts.models, q, moving, tau, a));
}

template <class S>
Outcome CertifiedAnswer<S>::inverse(const S* q, S* X) {
  return recomputed(parts_->factors->inverse(q, X));
}

template <class S>
Outcome CertifiedAnswer<S>::factor(const S* q) {
  return recomputed(parts_->factors->factor(q));
}

template <class S>
Outcome CertifiedAnswer<S>::solve(int columns, const S* taus, S* X) {
  return recomputed(parts_->factors->solve(columns, taus, X));
}

template <class S>
Outcome CertifiedAnswer<S>::diagonal(const S* q, S* x) {
  return recomputed(parts_->factors->diagonal(q, x));
}

template <class S>
Outcome CertifiedAnswer<S>::log_det(const S* q, S& x) {
  return recomputed(parts_->factors->log_det(q, x));
}

template <class S>
Outcome CertifiedAnswer<S>::selected(const S* q, S* X) {
  return recomputed(parts_->factors->selected(q, X));
}

template class CertifiedAnswer<float>;
template class CertifiedAnswer<double>;

}  // namespace kalmarm
