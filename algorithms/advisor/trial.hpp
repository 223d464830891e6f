// One candidate on the states of an Advisor: what it answers, and how long that takes.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "algorithms/spatial/spatial.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {

// Rows of states, of a robot and a question.
struct TrialStates {
  int count = 0, nq = 0, nv = 0;
  std::vector<double> q, qd, tau;  // count rows each
};

class Trial {
 public:
  virtual ~Trial() = default;

  // All that is wanted in a state. The first outcome that fails or warns, or else the last.
  virtual Outcome answer(int state) = 0;

  // The first `count` states, as they are timed.
  virtual void answer_first(int count) {
    for (int state = 0; state < count; ++state) static_cast<void>(answer(state));
  }

  // One after another what the last answer gave, in the order of Want.
  virtual VectorX<double> result() const = 0;

  // NaN for every number of the result.
  virtual void poison() = 0;
};

// Numbers that an answer to `want` holds: of so many DoF asked about, and rows of J.
inline int trial_size(Want want, int asked, int rows) {
  switch (want) {
    case Want::inverse:
    case Want::mass:
      return asked * asked;
    case Want::operational:
      return rows * rows;
    case Want::operational_diagonal:
      return rows;
    case Want::log_det:
      return 1;
    case Want::derivatives:
      return 0;  // of a: as right as a and M^-1 are
    default:
      return asked;
  }
}

template <class T>
class TrialBy final : public Trial {
 public:
  // Of a robot whose question wants `wants` and has `rows` rows of J.
  TrialBy(Dynamics<T> robot, const std::set<Want>& wants, int rows, const TrialStates& states)
      : robot_(std::move(robot)),
        wants_(wants.begin(), wants.end()),
        rows_(rows),
        nq_(states.nq),
        nv_(states.nv),
        q_(states.q.begin(), states.q.end()),
        qd_(states.qd.begin(), states.qd.end()),
        tau_(states.tau.begin(), states.tau.end()) {
    std::ptrdiff_t size = 0;
    for (const Want want : wants_) size += trial_size(want, robot_.asked(), rows_);
    result_.resize(size);
  }

  Outcome answer(int state) override {
    const VectorView<const T> q(q_.data() + std::ptrdiff_t(state) * nq_, nq_),
        qd(qd_.data() + std::ptrdiff_t(state) * nv_, nv_),
        tau(tau_.data() + std::ptrdiff_t(state) * nv_, nv_);
    Outcome kept;
    T* out = result_.data();
    for (const Want want : wants_) {
      const Outcome next = answer(want, q, qd, tau, out);
      if (kept && !kept.warns()) kept = next;
      out += trial_size(want, robot_.asked(), rows_);
    }
    return kept;
  }

  VectorX<double> result() const override { return result_.template cast<double>(); }

  void poison() override { result_.setConstant(std::numeric_limits<T>::quiet_NaN()); }

 private:
  using Row = VectorView<const T>;

  Outcome answer(Want want, const Row& q, const Row& qd, const Row& tau, T* out) {
    const int n = robot_.asked();
    switch (want) {
      case Want::acceleration:
        return robot_.forward_dynamics(q, qd, tau, VectorView<T>(out, n));
      case Want::inverse:
        return robot_.inverse_mass(q, MatrixView<T>(out, n, n));
      case Want::diagonal:
        return robot_.diagonal(q, VectorView<T>(out, n));
      case Want::log_det:
        return robot_.log_det(q, *out);
      case Want::operational:
        return robot_.operational(q, MatrixView<T>(out, rows_, rows_));
      case Want::operational_diagonal:
        return robot_.operational_diagonal(q, VectorView<T>(out, rows_));
      case Want::mass:
        robot_.mass(q, MatrixView<T>(out, n, n));
        return {};
      case Want::inverse_dynamics:
        robot_.inverse_dynamics(q, qd, tau, VectorView<T>(out, n));
        return {};
      case Want::solve: {
        const Outcome outcome = robot_.factor(q);
        if (!outcome) return outcome;
        return robot_.solve(MatrixView<const T>(tau.data(), n, 1), MatrixView<T>(out, n, 1));
      }
      case Want::derivatives:
        break;
    }
    return {};
  }

  Dynamics<T> robot_;
  std::vector<Want> wants_;
  int rows_, nq_, nv_;
  std::vector<T> q_, qd_, tau_;
  VectorX<T> result_;
};

// The same of rows: all states in one call, which lanes answer.
template <class T>
class TrialOfRows final : public Trial {
 public:
  TrialOfRows(Dynamics<T> robot, const std::set<Want>& wants, int rows_of_J,
              const TrialStates& states)
      : robot_(std::move(robot)),
        states_(states.count),
        nq_(states.nq),
        nv_(states.nv),
        q_(states.q.begin(), states.q.end()),
        qd_(states.qd.begin(), states.qd.end()),
        tau_(states.tau.begin(), states.tau.end()),
        outcomes_(states.count) {
    for (const Want want : wants) {
      const int width = trial_size(want, robot_.asked(), rows_of_J);
      results_.push_back({want, width, std::vector<T>(std::size_t(width) * states_)});
    }
    poison();
  }

  Outcome answer(int state) override {
    if (!answered_) answer_first(states_);
    answered_ = true;
    state_ = state;
    return outcomes_[state];
  }

  void answer_first(int count) override {
    outcomes_.assign(states_, Outcome());
    std::vector<Outcome> next(count);
    for (Result& result : results_) {
      answer(count, result, next);
      for (int i = 0; i < count; ++i)
        if (outcomes_[i] && !outcomes_[i].warns()) outcomes_[i] = next[i];
    }
  }

  VectorX<double> result() const override {
    std::vector<double> out;
    for (const Result& result : results_) {
      const auto row = result.rows.begin() + std::ptrdiff_t(state_) * result.width;
      out.insert(out.end(), row, row + result.width);
    }
    return Eigen::Map<const VectorX<double>>(out.data(), static_cast<Eigen::Index>(out.size()));
  }

  // Before the call alone: it answers every state.
  void poison() override {
    if (answered_) return;
    for (Result& result : results_)
      std::fill(result.rows.begin(), result.rows.end(), std::numeric_limits<T>::quiet_NaN());
  }

 private:
  struct Result {
    Want want;
    int width;
    std::vector<T> rows;
  };

  void answer(int count, Result& result, std::vector<Outcome>& outcomes) {
    const RowsView<const T> q(q_.data(), count, nq_), qd(qd_.data(), count, nv_),
        tau(tau_.data(), count, nv_);
    const RowsView<T> out(result.rows.data(), count, result.width);
    // Outcomes say which rows failed.
    switch (result.want) {
      case Want::acceleration:
        return void(robot_.forward_dynamics(q, qd, tau, out, outcomes));
      case Want::inverse:
        return void(robot_.inverse_mass(q, out, outcomes));
      case Want::diagonal:
        return void(robot_.diagonal(q, out, outcomes));
      case Want::log_det:
        return void(robot_.log_det(q, out, outcomes));
      case Want::operational:
        return void(robot_.operational(q, out, outcomes));
      case Want::operational_diagonal:
        return void(robot_.operational_diagonal(q, out, outcomes));
      case Want::mass:
        return void(robot_.mass(q, out, outcomes));
      case Want::solve:
        return void(robot_.solve(q, tau, out, outcomes));
      case Want::inverse_dynamics:
        outcomes.assign(count, Outcome());
        return robot_.inverse_dynamics(q, qd, tau, out, 1);
      case Want::derivatives:
        break;
    }
  }

  Dynamics<T> robot_;
  int states_, nq_, nv_;
  std::vector<T> q_, qd_, tau_;
  std::vector<Outcome> outcomes_;
  std::vector<Result> results_;
  bool answered_ = false;
  int state_ = 0;
};

// One call a state, or one of all of them.
template <class T>
std::unique_ptr<Trial> make_trial(Dynamics<T> robot, const std::set<Want>& wants, int rows_of_J,
                                  const TrialStates& states, bool in_rows) {
  if (in_rows) return std::make_unique<TrialOfRows<T>>(std::move(robot), wants, rows_of_J, states);
  return std::make_unique<TrialBy<T>>(std::move(robot), wants, rows_of_J, states);
}

}  // namespace kalmarm
