// Which tolerance is enough for a robot, and for rows of states which precision: measured on states
// that it will be in.
//
//   const auto advice = kalmarm::recommend(model, q, qd, tau, {.tolerance = 1e-6});
//   if (advice.precision == kalmarm::Precision::float32)
//     kalmarm::Dynamics<float> robot(model, {.tolerance = advice.tolerance});
//
// The default tolerance and the last bits answer the question in every state, of rows in both
// precisions, and are compared with an answer that is right to the last bits of double, or says that
// it is not; the rule and its equations stand in algorithms/advisor/advisor.hpp.
#pragma once

#include <stdexcept>
#include <string>

#include "kalmarm/dynamics.hpp"
#include "kalmarm/export.hpp"

namespace kalmarm {

// float32 is for rows of states, which lanes of it answer: one state is answered in double whatever the
// precision.
enum class Precision { float32, float64 };

KALMARM_EXPORT const char* to_string(Precision precision);

struct RecommendOptions {
  double tolerance = 1e-6;  // on |da| / |a|, and on M^-1 scaled by its diagonal
  Question question = {.want = {Want::acceleration, Want::inverse}};  // all but derivatives
  bool rows = true;  // many states a call; else one, which float64 answers in any case
};

struct Recommendation {
  double tolerance = default_tolerance<double>;  // of Dynamics
  Precision precision = Precision::float64;      // float32: of rows alone
  double worst = 0;        // error in these states; infinite where one has no answer or a warning
  double predicted = 0;    // what to expect in states like these
  double nanoseconds = 0;  // a state on this machine, for all that is wanted
  bool enough = false;     // predicted within the tolerance; else the most accurate is given
  std::string reason;      // one sentence
};

namespace detail {
KALMARM_EXPORT Recommendation recommend(const RobotModel& model, int count, const double* q,
                                        const double* qd, const double* tau,
                                        const RecommendOptions& options);
}

// Rows of at least one state: q (nq), qd and tau (nv). Throws std::invalid_argument where sizes
// differ, the tolerance is below the roundoff of double, or the question contradicts the model.
inline Recommendation recommend(const RobotModel& model, RowsView<const double> q,
                                RowsView<const double> qd, RowsView<const double> tau,
                                const RecommendOptions& options = {}) {
  const std::ptrdiff_t count = model.nq > 0 ? q.size() / model.nq : 0;
  const auto fit = [&](const char* what, const RowsView<const double>& rows, int width) {
    if (count < 1 || !rows.fits(count, width))
      throw std::invalid_argument(std::string("recommend: ") + what + " is " + rows.shape() +
                                  ", not rows of " + std::to_string(width));
  };
  fit("q", q, model.nq);
  fit("qd", qd, model.nv());
  fit("tau", tau, model.nv());
  return detail::recommend(model, static_cast<int>(count), q.data(), qd.data(), tau.data(),
                           options);
}

}  // namespace kalmarm
