// What checks answers (kalmarm/check.hpp): plain numbers, compiled once an instruction set.
#pragma once

#include <cstddef>
#include <memory>

#include "kalmarm/check.hpp"
#include "kalmarm/question.hpp"

namespace kalmarm {

// Rows of states with an answer x each; what is not asked for is null.
//   want               qd   tau   x
//   acceleration       qd   tau   a
//   inverse_dynamics   qd   qdd   torques
//   solve                   tau   M^-1 tau
//   mass, inverse                 nv^2 numbers, by columns
struct CheckCall {
  Want want;
  const double* q = nullptr;
  const double* qd = nullptr;
  const double* tau = nullptr;
  const double* x = nullptr;

  bool is_matrix() const { return want == Want::mass || want == Want::inverse; }

  // Of the rows from i on.
  CheckCall from(std::ptrdiff_t i, std::ptrdiff_t nq, std::ptrdiff_t nv) const {
    return {want, q + i * nq, qd ? qd + i * nv : nullptr, tau ? tau + i * nv : nullptr,
            x + i * nv * (is_matrix() ? nv : 1)};
  }
};

class CheckEngine {
 public:
  virtual ~CheckEngine() = default;
  // Memory for so many workers: numbered from 0, they may be called at the same time.
  virtual void reserve_workers(int count) = 0;
  virtual void answer_rows(int worker, int count, const CheckCall& call, AnswerError* errors) = 0;
};

// By kernels for the best instruction set there is.
std::unique_ptr<CheckEngine> make_check(const RobotModel& robot, const AnswerCheckOptions& options);

}  // namespace kalmarm
