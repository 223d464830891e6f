// Answers refined by residuals in twice the precision, and by two doubles where that does not do: to states
// of which a kernel's own numbers do not say that its answer can be used, or to all of them. A warning or a
// refusal is then theirs, and Outcome::error their estimate.
#pragma once

#include <memory>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"

namespace kalmarm {

struct CertifiedModels;
template <class T>
struct CovarianceWorkspace;

// `lowered` is kept by reference.
std::shared_ptr<const CertifiedModels> make_certified_models(const LoweredModel<double>& lowered,
                                                             const RobotModel& robot,
                                                             const EngineOptions& options);

// The memory of one worker.
class CertifiedAnswer {
 public:
  // What is made is what options.want names, and for derivatives what they are judged by: factors, or where
  // all is refined their a. at_rest: of robots that never move, whose qd is not looked at.
  CertifiedAnswer(std::shared_ptr<const CertifiedModels> models, const EngineOptions& options,
                  bool at_rest);
  CertifiedAnswer(CertifiedAnswer&&) noexcept;
  CertifiedAnswer& operator=(CertifiedAnswer&&) noexcept;
  ~CertifiedAnswer();

  // As those of Engine. With joint noise a is that of two doubles; swept: of a sweep that has been made for
  // an acceleration, whose a is refined.
  Outcome answer(const Call<double>& call, const CovarianceWorkspace<double>* swept = nullptr);
  Outcome factor(const Call<double>& call);
  Outcome solve(int columns, const double* taus, double* X);

  // Accelerations of the rows that are left over, a state in every lane, in memory that reserve_rows has
  // taken.
  void reserve_rows();
  void answer_rows(int count, const Call<double>& call, Outcome* outcomes, const char* left_over);

  // Columns x = M^-1 tau at a position that is kept: its factors are made for the first.
  void keep(const Call<double>& call);
  Outcome column(const double* tau, double* x);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace kalmarm
