#include "accuracy/limits/judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <stdexcept>

#include "accuracy/measures/measures.hpp"
#include "accuracy/truth/truth.hpp"

namespace kalmarm::limits {
namespace {

using Wide = long double;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double silent_error = 0.01;
constexpr double largest_error = 1e300;
constexpr double fair_share = 0.1;  // of the largest part

template <class T>
constexpr const char* judge_of =
    std::is_same_v<T, float> ? "FactoredBias<ArrayGivens>"
                             : "WideRefined<FactoredBias<ArrayGivens>>";

Answer answer(const Outcome& outcome, double error) {
  if (!outcome) return {.error = nan, .refused = true};
  return {.error = error <= largest_error ? error : largest_error, .warned = outcome.warns()};
}

template <class T, class S>
Answer acceleration(Solver<T>& solver, const State& state, const VectorX<S>& exact) {
  VectorX<T> a = VectorX<T>::Constant(exact.size(), std::numeric_limits<T>::quiet_NaN());
  const Outcome outcome =
      solver.acceleration(state.q.cast<T>(), state.qd.cast<T>(), state.tau.cast<T>(), a);
  const VectorX<S> da = a.template cast<S>() - exact;
  return answer(outcome, quotient<S>(da.norm(), exact.norm()));
}

template <class T, class S>
Answer inverse(Solver<T>& solver, const State& state, const MatrixX<S>& exact) {
  MatrixX<T> X =
      MatrixX<T>::Constant(exact.rows(), exact.cols(), std::numeric_limits<T>::quiet_NaN());
  const Outcome outcome = solver.inverse(state.q.cast<T>(), X);
  return answer(outcome, matrix_error(X, exact).scaled);
}

template <class T>
void add_verified(const Model<double>& model, Want task, const State& state,
                  const Truth<double>& exact, std::vector<Answer>& out) {
  for (const char* variant : variants) {
    const std::unique_ptr<Solver<T>> solver = make_solver<T>(variant, model.cast<T>());
    out.push_back(task == Want::inverse ? inverse(*solver, state, exact.X)
                                        : acceleration(*solver, state, exact.responses[0].a));
  }
}

}  // namespace

bool Answer::silent() const { return !refused && !warned && !(error <= silent_error); }

State held_by_float(const State& state) {
  const auto held = [](const VectorX<double>& x) -> VectorX<double> {
    return x.cast<float>().cast<double>();
  };
  return {held(state.q), held(state.qd), held(state.tau)};
}

template <class T>
Judge<T>::Judge(const Model<double>& model, Want task)
    : task_(task),
      reference_(make_solver<double>(judge_of<T>, model)),
      plain_(make_solver<double>("Ladder<default>", model)),
      zero_(VectorX<double>::Zero(model.nv())),
      a_(zero_),
      gravity_(zero_),
      bias_(zero_),
      X_(model.nv(), model.nv()) {
  for (int i = 0; i < searched_variants; ++i)
    solvers_.push_back(make_solver<T>(variants[i], model.cast<T>()));
}

template <class T>
double Judge<T>::set_state(const State& state) {
  state_ = state;
  if (task_ == Want::inverse) return reference_->inverse(state.q, X_) ? 1 : 0;
  return reference_->acceleration(state.q, state.qd, state.tau, a_) ? fairness() : 0;
}

template <class T>
double Judge<T>::fairness() {
  if (!plain_->acceleration(state_.q, zero_, zero_, gravity_) ||
      !plain_->acceleration(state_.q, state_.qd, zero_, bias_))
    return 1;
  const double largest =
      std::max({gravity_.norm(), (bias_ - gravity_).norm(), (a_ - bias_).norm()});
  return std::min(1.0, a_.norm() / (fair_share * largest));
}

template <class T>
Answer Judge<T>::operator()(int variant) {
  Solver<T>& solver = *solvers_[variant];
  if (task_ == Want::inverse) return inverse<T, Wide>(solver, state_, X_.cast<Wide>());
  return acceleration<T, Wide>(solver, state_, a_.cast<Wide>());
}

std::optional<std::vector<Answer>> verify(const Model<double>& model, Want task,
                                          const State& state) {
  static std::mutex one_at_a_time;  // the digits are the process's
  const std::lock_guard lock(one_at_a_time);
  Truth<double> exact;
  try {
    exact =
        truth<double>(model, state.q, {{state.tau, state.qd}}, {.matrices = task == Want::inverse});
  } catch (const std::runtime_error&) {  // not within a thousand digits
    return std::nullopt;
  }
  if (!exact.outcome) return std::nullopt;
  std::vector<Answer> out;
  add_verified<float>(model, task, state, exact, out);
  add_verified<double>(model, task, state, exact, out);
  return out;
}

template class Judge<float>;
template class Judge<double>;

}  // namespace kalmarm::limits
