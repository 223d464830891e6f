// AnswerCheck: how wrong an answer is that somebody else has worked out, whoever that is, and a verdict.
//
//   kalmarm::AnswerCheck check(model, {.tolerance = 1e-6});
//   kalmarm::AnswerError e = check.forward_dynamics(q, qd, tau, a);   // of an a that is given
//   if (e.verdict == kalmarm::Verdict::wrong) std::cout << e.error << "\n";
//
// What is worked out is the error, not the answer again. Of an acceleration a with the exact one a*,
//   r = tau - ID(q, qd, a)                    what a leaves of the torques, in twice the precision     (1)
//   |a - a*|_M^2 = r' M^-1 r = sum of nu(k)^2 / D(k),   nu = (I - L) r                                (2)
// with D and L of the filter, M^-1 = (I - L*) D^-1 (I - L): exact, for any a. The energy norm |x|_M^2 = x' M x is
// that of the robot's kinetic energy. Of other answers:
//   x = M^-1 tau          (1) at rest without gravity, r = tau - M x
//   X = M^-1              the same of each column, tau = e_j: X - X* = -M^-1 r
//   tau = ID(q, qd, qdd)  r itself is the error
//   M                     M e_j of every column likewise
//
//   answer     `error`                                                   `euclid`
//   a, M^-1 tau  |x - x*|_M / |x*|_M                                       |x - x*| / |x*|
//   M^-1         of the worst entry, |X - X*|_ij / sqrt(X*_ii X*_jj)         the same
//   tau          |tau - tau*| / |tau*|                                     the same
//   M            of the worst entry, |M - M*|_ij / sqrt(M*_ii M*_jj)       the same
//
// Each with |.| Euclid's norm. A rung tells an error where it is at least twelve times what rounding of the rung
// itself may add, `uncertainty` (docs/errors.md); where it is less the next one is asked:
//   float64     the filter's own answer beside the given one: whatever is wrong by 1e-9 or more
//   refined     (1) in pairs of doubles, to less than the last bits of double
//   two_doubles where D may be lost in rounding; what that cannot tell is Verdict::unknown, and the outcome warns
//
// Verdicts are about the tolerance: `right`, both errors are at most that, in which |a*| counts as 0.01 |gravity|
// and |a*|_M as the energy of all bodies at that acceleration where these are more; `wrong`, one of them is more.
// An answer that is not finite is wrong by infinity; for a state that is not, or where M cannot be told from a
// singular matrix, there is no answer: `unknown`, and the outcome says which.
//
// Answers of float32 are given as doubles: the error is then that of the exact answer for q, qd and tau as they are
// given. Sizes are checked: std::invalid_argument. Memory is taken when the object is made, and for rows on more
// threads than before; one thread at a time may use an object.
#pragma once

#include <limits>
#include <memory>
#include <span>

#include "kalmarm/export.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/robot_model.hpp"
#include "kalmarm/tolerance.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

enum class Verdict { right, wrong, unknown };

KALMARM_EXPORT const char* to_string(Verdict verdict);

struct [[nodiscard]] AnswerError {
  Verdict verdict = Verdict::unknown;
  double error = std::numeric_limits<double>::quiet_NaN();
  double euclid = std::numeric_limits<double>::quiet_NaN();
  double uncertainty = std::numeric_limits<double>::quiet_NaN();  // by which `error` may be off
  Outcome outcome = {};  // of the check: its rung, and why there is no certain error
};

struct AnswerCheckOptions {
  double tolerance = default_tolerance<double>;  // of verdicts, above 0
  // Errors below it need not be told apart: `error` + `uncertainty` is then at most that. At 1e-8 a check of rows
  // costs 1.3 to 1.7 times what accelerations in float64 do; at 0, of answers near roundoff, 4 to 5 times.
  double resolution = 0;
};

struct CheckCall;
class CheckEngine;
class Threads;

class KALMARM_EXPORT AnswerCheck {
 public:
  // Throws std::invalid_argument where the model is what no robot can be, as Dynamics does, and where the
  // tolerance is not above 0 or the resolution below.
  explicit AnswerCheck(const RobotModel& model, const AnswerCheckOptions& options = {});
  ~AnswerCheck();
  AnswerCheck(AnswerCheck&&) noexcept;
  AnswerCheck& operator=(AnswerCheck&&) noexcept;

  int nq() const { return nq_; }
  int nv() const { return nv_; }

  // Of a (nv) for q (nq), qd and tau (nv): (2) of (1). 600 n flops, and 2000 n where the refined rung answers.
  AnswerError forward_dynamics(VectorView<const double> q, VectorView<const double> qd,
                               VectorView<const double> tau, VectorView<const double> a);
  // Rows of states, one error each, on `threads` cores. Returns how many are not Verdict::right; the same below.
  int forward_dynamics(RowsView<const double> q, RowsView<const double> qd,
                       RowsView<const double> tau, RowsView<const double> a,
                       std::span<AnswerError> errors, int threads = 1);

  // Of tau (nv) for qdd (nv). 1600 n.
  AnswerError inverse_dynamics(VectorView<const double> q, VectorView<const double> qd,
                               VectorView<const double> qdd, VectorView<const double> tau);
  int inverse_dynamics(RowsView<const double> q, RowsView<const double> qd,
                       RowsView<const double> qdd, RowsView<const double> tau,
                       std::span<AnswerError> errors, int threads = 1);

  // Of x = M^-1 tau (nv). 1800 n.
  AnswerError solve(VectorView<const double> q, VectorView<const double> tau,
                    VectorView<const double> x);
  int solve(RowsView<const double> q, RowsView<const double> tau, RowsView<const double> x,
            std::span<AnswerError> errors, int threads = 1);

  // Of M (nv x nv), both triangles. 1000 n^2.
  AnswerError mass(VectorView<const double> q, MatrixView<const double> M);
  int mass(RowsView<const double> q, RowsView<const double> M, std::span<AnswerError> errors,
           int threads = 1);

  // Of X = M^-1 (nv x nv), both triangles. 1300 n^2.
  AnswerError inverse_mass(VectorView<const double> q, MatrixView<const double> X);
  int inverse_mass(RowsView<const double> q, RowsView<const double> X,
                   std::span<AnswerError> errors, int threads = 1);

 private:
  int answer(const CheckCall& call, std::span<AnswerError> errors, int threads);

  int nq_ = 0, nv_ = 0;
  std::unique_ptr<CheckEngine> engine_;
  std::unique_ptr<Threads> threads_;
};

}  // namespace kalmarm
