// The certified form's answers to a state of which a kernel's own numbers do not say that its answer
// can be used. A warning or a refusal is then the certified form's, and Outcome::error its estimate;
// Outcome::recomputed is set.
#pragma once

#include <memory>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"

namespace kalmarm {

template <class S>
class CertifiedAnswer {
 public:
  // What is made is what options.want names, and factors for derivatives, which are judged by them.
  // `lowered` is kept by reference. at_rest: of robots that never move, whose qd is not looked at.
  CertifiedAnswer(const RobotModel& robot, const LoweredModel<S>& lowered,
                  const EngineOptions& options, bool at_rest);
  CertifiedAnswer(CertifiedAnswer&&) noexcept;
  ~CertifiedAnswer();

  // As those of Engine.
  Outcome acceleration(const S* q, const S* qd, const S* tau, S* a);
  Outcome inverse(const S* q, S* X);
  Outcome factor(const S* q);
  Outcome solve(int columns, const S* taus, S* X);
  Outcome diagonal(const S* q, S* x);
  Outcome log_det(const S* q, S& x);
  Outcome selected(const S* q, S* X);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

extern template class CertifiedAnswer<float>;
extern template class CertifiedAnswer<double>;

}  // namespace kalmarm
