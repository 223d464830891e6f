// The certified form's answers to a state of which a kernel's own numbers do not say that its answer
// can be used. A warning or a refusal is then the certified form's, and Outcome::error its estimate;
// Outcome::recomputed is set.
#pragma once

#include <memory>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"

namespace kalmarm {

class CertifiedAnswer {
 public:
  // What is made is what options.want names, and factors for derivatives, which are judged by them.
  // `lowered` is kept by reference. at_rest: of robots that never move, whose qd is not looked at.
  CertifiedAnswer(const RobotModel& robot, const LoweredModel<double>& lowered,
                  const EngineOptions& options, bool at_rest);
  CertifiedAnswer(CertifiedAnswer&&) noexcept;
  ~CertifiedAnswer();

  // As those of Engine.
  Outcome acceleration(const double* q, const double* qd, const double* tau, double* a);
  Outcome inverse(const double* q, double* X);
  Outcome factor(const double* q);
  Outcome solve(int columns, const double* taus, double* X);
  Outcome diagonal(const double* q, double* x);
  Outcome log_det(const double* q, double& x);
  Outcome selected(const double* q, double* X);

  // Columns x = M^-1 tau at a position that is kept: its factors are made for the first.
  void keep(const double* q);
  Outcome column(const double* tau, double* x);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace kalmarm
