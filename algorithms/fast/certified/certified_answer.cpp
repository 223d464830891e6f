#include "algorithms/fast/certified/certified_answer.hpp"

#include <vector>

#include "algorithms/fast/certified/certified_acceleration.hpp"

namespace kalmarm {

template <class S>
struct CertifiedAnswer<S>::Parts {
  CertifiedModels<S> models;
  CertifiedAcceleration<S> answer;
  std::vector<S> no_velocity;  // (nv) of robots at rest, else empty

  Parts(const RobotModel& robot, const LoweredModel<S>& lowered, bool at_rest)
      : models(lowered, model_of(robot).template cast<S>()),
        answer(models),
        no_velocity(at_rest ? lowered.nv() : 0, S(0)) {}
};

template <class S>
CertifiedAnswer<S>::CertifiedAnswer(const RobotModel& robot, const LoweredModel<S>& lowered,
                                    bool at_rest)
    : parts_(std::make_unique<Parts>(robot, lowered, at_rest)) {}

template <class S>
CertifiedAnswer<S>::CertifiedAnswer(CertifiedAnswer&&) noexcept = default;
template <class S>
CertifiedAnswer<S>::~CertifiedAnswer() = default;

template <class S>
Outcome CertifiedAnswer<S>::acceleration(const S* q, const S* qd, const S* tau, S* a) {
  Parts& parts = *parts_;
  const S* const moving = parts.no_velocity.empty() ? qd : parts.no_velocity.data();
  Outcome out = parts.answer.acceleration(parts.models, q, moving, tau, a);
  out.suspect = static_cast<bool>(out);
  return out;
}

template class CertifiedAnswer<float>;
template class CertifiedAnswer<double>;

}  // namespace kalmarm
