// The certified form's answer to a state that a sweep of another form is not sure of. A warning or
// a refusal is then the certified form's, and Outcome::error its estimate; Outcome::suspect is set.
#pragma once

#include <memory>

#include "algorithms/fast/lowering/lowered_model.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

template <class S>
class CertifiedAnswer {
 public:
  // `lowered` is kept by reference. at_rest: of robots that never move, whose qd is not looked at.
  CertifiedAnswer(const RobotModel& robot, const LoweredModel<S>& lowered, bool at_rest);
  CertifiedAnswer(CertifiedAnswer&&) noexcept;
  ~CertifiedAnswer();

  // a (nv) from q (nq), qd (nv), tau (nv).
  Outcome acceleration(const S* q, const S* qd, const S* tau, S* a);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

extern template class CertifiedAnswer<float>;
extern template class CertifiedAnswer<double>;

}  // namespace kalmarm
