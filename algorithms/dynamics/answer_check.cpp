#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/dynamics/threads.hpp"
#include "algorithms/fast/check/check_engine.hpp"

namespace kalmarm {
namespace {

// Rows that a worker takes at once.
constexpr int rows_of_a_worker = 64;

[[noreturn]] void refuse(const char* call, const char* what, const std::string& given,
                         const std::string& needed) {
  throw std::invalid_argument(std::string("check of ") + call + ": " + what + " has size " + given +
                              ", " + needed + " is needed");
}

void need(const char* call, const char* what, const VectorView<const double>& x, int size) {
  if (x.size() != size) refuse(call, what, std::to_string(x.size()), std::to_string(size));
}
void need(const char* call, const char* what, const RowsView<const double>& x, std::ptrdiff_t count,
          std::ptrdiff_t width) {
  if (!x.fits(count, width)) refuse(call, what, x.shape(), detail::shape(count, width));
}
// What rows hold where it should be symmetric is as wrong as what columns hold.
void need(const char* call, const char* what, const MatrixView<const double>& X, int n) {
  if (!X.fits(n, n)) refuse(call, what, X.shape(), detail::shape(n, n));
}

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::right:
      return "right";
    case Verdict::wrong:
      return "wrong";
    case Verdict::unknown:
      return "unknown";
  }
  return "?";
}

AnswerCheck::AnswerCheck(const RobotModel& model, const AnswerCheckOptions& options)
    : nq_(model.nq), nv_(model.nv()) {
  check_model(model, std::numeric_limits<double>::max());
  if (!(options.tolerance > 0))
    throw std::invalid_argument("AnswerCheck: tolerance is " + std::to_string(options.tolerance) +
                                ": more than 0 is needed");
  if (!(options.resolution >= 0))
    throw std::invalid_argument("AnswerCheck: resolution is " + std::to_string(options.resolution) +
                                ": 0 or more is needed");
  engine_ = make_check(model, options);
  threads_ = std::make_unique<Threads>();
}

AnswerCheck::~AnswerCheck() = default;
AnswerCheck::AnswerCheck(AnswerCheck&&) noexcept = default;
AnswerCheck& AnswerCheck::operator=(AnswerCheck&&) noexcept = default;

int AnswerCheck::answer(const CheckCall& call, std::span<AnswerError> errors, int threads) {
  if (!engine_) throw std::logic_error("AnswerCheck: was moved from, and answers nothing");
  const auto count = static_cast<std::ptrdiff_t>(errors.size());
  const auto blocks = static_cast<int>((count + rows_of_a_worker - 1) / rows_of_a_worker);
  const auto block = [&](int worker, int i) {
    const std::ptrdiff_t first = std::ptrdiff_t(i) * rows_of_a_worker,
                         rows = std::min<std::ptrdiff_t>(rows_of_a_worker, count - first);
    engine_->answer_rows(worker, static_cast<int>(rows), call.from(first, nq_, nv_),
                         errors.data() + first);
  };
  if (threads <= 1 || blocks <= 1) {
    for (int i = 0; i < blocks; ++i) block(0, i);
  } else {
    engine_->reserve_workers(threads);
    threads_->run(threads, blocks, block);
  }
  return static_cast<int>(std::count_if(errors.begin(), errors.end(), [](const AnswerError& one) {
    return one.verdict != Verdict::right;
  }));
}

AnswerError AnswerCheck::forward_dynamics(VectorView<const double> q, VectorView<const double> qd,
                                          VectorView<const double> tau,
                                          VectorView<const double> a) {
  need("forward_dynamics", "q", q, nq_);
  need("forward_dynamics", "qd", qd, nv_);
  need("forward_dynamics", "tau", tau, nv_);
  need("forward_dynamics", "a", a, nv_);
  AnswerError out;
  answer({Want::acceleration, q.data(), qd.data(), tau.data(), a.data()}, {&out, 1}, 1);
  return out;
}

int AnswerCheck::forward_dynamics(RowsView<const double> q, RowsView<const double> qd,
                                  RowsView<const double> tau, RowsView<const double> a,
                                  std::span<AnswerError> errors, int threads) {
  const auto count = static_cast<std::ptrdiff_t>(errors.size());
  need("forward_dynamics", "q", q, count, nq_);
  need("forward_dynamics", "qd", qd, count, nv_);
  need("forward_dynamics", "tau", tau, count, nv_);
  need("forward_dynamics", "a", a, count, nv_);
  return answer({Want::acceleration, q.data(), qd.data(), tau.data(), a.data()}, errors, threads);
}

AnswerError AnswerCheck::inverse_dynamics(VectorView<const double> q, VectorView<const double> qd,
                                          VectorView<const double> qdd,
                                          VectorView<const double> tau) {
  need("inverse_dynamics", "q", q, nq_);
  need("inverse_dynamics", "qd", qd, nv_);
  need("inverse_dynamics", "qdd", qdd, nv_);
  need("inverse_dynamics", "tau", tau, nv_);
  AnswerError out;
  answer({Want::inverse_dynamics, q.data(), qd.data(), qdd.data(), tau.data()}, {&out, 1}, 1);
  return out;
}

int AnswerCheck::inverse_dynamics(RowsView<const double> q, RowsView<const double> qd,
                                  RowsView<const double> qdd, RowsView<const double> tau,
                                  std::span<AnswerError> errors, int threads) {
  const auto count = static_cast<std::ptrdiff_t>(errors.size());
  need("inverse_dynamics", "q", q, count, nq_);
  need("inverse_dynamics", "qd", qd, count, nv_);
  need("inverse_dynamics", "qdd", qdd, count, nv_);
  need("inverse_dynamics", "tau", tau, count, nv_);
  return answer({Want::inverse_dynamics, q.data(), qd.data(), qdd.data(), tau.data()}, errors,
                threads);
}

AnswerError AnswerCheck::solve(VectorView<const double> q, VectorView<const double> tau,
                               VectorView<const double> x) {
  need("solve", "q", q, nq_);
  need("solve", "tau", tau, nv_);
  need("solve", "x", x, nv_);
  AnswerError out;
  answer({Want::solve, q.data(), nullptr, tau.data(), x.data()}, {&out, 1}, 1);
  return out;
}

int AnswerCheck::solve(RowsView<const double> q, RowsView<const double> tau,
                       RowsView<const double> x, std::span<AnswerError> errors, int threads) {
  const auto count = static_cast<std::ptrdiff_t>(errors.size());
  need("solve", "q", q, count, nq_);
  need("solve", "tau", tau, count, nv_);
  need("solve", "x", x, count, nv_);
  return answer({Want::solve, q.data(), nullptr, tau.data(), x.data()}, errors, threads);
}

AnswerError AnswerCheck::mass(VectorView<const double> q, MatrixView<const double> M) {
  need("mass", "q", q, nq_);
  need("mass", "M", M, nv_);
  AnswerError out;
  answer({Want::mass, q.data(), nullptr, nullptr, M.data()}, {&out, 1}, 1);
  return out;
}

int AnswerCheck::mass(RowsView<const double> q, RowsView<const double> M,
                      std::span<AnswerError> errors, int threads) {
  const auto count = static_cast<std::ptrdiff_t>(errors.size());
  need("mass", "q", q, count, nq_);
  need("mass", "M", M, count, std::ptrdiff_t(nv_) * nv_);
  return answer({Want::mass, q.data(), nullptr, nullptr, M.data()}, errors, threads);
}

AnswerError AnswerCheck::inverse_mass(VectorView<const double> q, MatrixView<const double> X) {
  need("inverse_mass", "q", q, nq_);
  need("inverse_mass", "X", X, nv_);
  AnswerError out;
  answer({Want::inverse, q.data(), nullptr, nullptr, X.data()}, {&out, 1}, 1);
  return out;
}

int AnswerCheck::inverse_mass(RowsView<const double> q, RowsView<const double> X,
                              std::span<AnswerError> errors, int threads) {
  const auto count = static_cast<std::ptrdiff_t>(errors.size());
  need("inverse_mass", "q", q, count, nq_);
  need("inverse_mass", "X", X, count, std::ptrdiff_t(nv_) * nv_);
  return answer({Want::inverse, q.data(), nullptr, nullptr, X.data()}, errors, threads);
}

}  // namespace kalmarm
