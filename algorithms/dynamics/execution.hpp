// Executes a plan: gathers each part's state from the robot's, asks the part's engine, scatters the
// result. Engines, memory and what is copied where are settled when the object is made.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/part_state.hpp"
#include "algorithms/dynamics/threads.hpp"

namespace kalmarm {

// Only what the question wants may be called: else std::logic_error. Pointers are those of
// Dynamics, whose header says what they hold.
template <class T>
class Execution {
 public:
  Execution(Plan plan, int nq, double tolerance, Triangles triangles, const MakeEngine<T>& make)
      : plan_(std::move(plan)),
        tolerance_(tolerance),
        make_(make),
        nq_(nq),
        asked_(static_cast<int>(plan_.asked.size())),
        rows_(6 * static_cast<int>(plan_.question.frames.size())),
        at_rest_(plan_.question.at_rest),
        zero_(plan_.nv, T(0)),
        factored_q_(nq, T(0)) {
    for (const Want want : plan_.question.want) wanted_ |= bit(want);
    const bool nothing_to_copy = plan_.parts.size() == 1 && asked_ == plan_.nv &&
                                 plan_.parts[0].reduction.model.nv() == plan_.nv &&
                                 plan_.question.locked.empty();
    // What is copied is copied whole.
    if (!nothing_to_copy) triangles = Triangles::both;
    for (const Part& part : plan_.parts)
      parts_.emplace_back(plan_, part, tolerance, triangles, make, nothing_to_copy);
    if (nothing_to_copy) whole_ = parts_[0].engine.get();
  }

  const Plan& plan() const { return plan_; }
  int asked() const { return asked_; }
  int rows() const { return rows_; }  // of J

  Outcome forward_dynamics(const T* q, const T* qd, const T* tau, T* a) {
    need(Want::acceleration);
    if (whole_) return whole_->forward_dynamics(q, at_rest_ ? zero_.data() : qd, tau, a);
    return each([&](PartState<T>& p) {
      p.gather(q, qd, tau);
      const Outcome outcome =
          p.engine->forward_dynamics(p.q.data(), p.qd.data(), p.tau_or_qdd.data(), p.a.data());
      p.asked(p.a.data(), a);
      return outcome;
    });
  }

  int forward_dynamics(int count, const T* q, const T* qd, const T* tau, T* a, Outcome* outcomes,
                       int threads);

  // r (nv a row): joint noise in place of the robot's, as Engine has it; no joint is locked or at rest.
  int forward_dynamics(int count, const T* q, const T* qd, const T* tau, const T* r, T* a,
                       Outcome* outcomes, int threads);

  // B and X: asked x m, torques of joints that are not asked about being zero.
  Outcome forward_dynamics(const T* q, const T* qd, const T* tau, T* a, int m, const T* B, T* X) {
    need(Want::solve);
    need(Want::acceleration);
    if (whole_) return whole_->forward_dynamics(q, at_rest_ ? zero_.data() : qd, tau, a, m, B, X);
    const Outcome of_a = forward_dynamics(q, qd, tau, a);
    if (!of_a) return of_a;
    const Outcome of_D = factor_parts(q);
    return of_D ? solve_parts(m, B, X, worse(of_a, of_D)) : of_D;
  }

  // X: m columns a row.
  int forward_dynamics(int count, const T* q, const T* qd, const T* tau, T* a, int m, const T* B,
                       T* X, Outcome* outcomes, int threads);

  // qd, qdd: null where they are zero.
  void inverse_dynamics(const T* q, const T* qd, const T* qdd, T* tau) {
    need(Want::inverse_dynamics);
    if (!qd || at_rest_) qd = zero_.data();
    if (!qdd) qdd = zero_.data();
    if (whole_) return whole_->inverse_dynamics(q, qd, qdd, tau);
    for (PartState<T>& p : parts_) {
      p.gather(q, qd, qdd);
      p.engine->inverse_dynamics(p.q.data(), p.qd.data(), p.tau_or_qdd.data(), p.a.data());
      p.asked(p.a.data(), tau);
    }
  }

  void inverse_dynamics(int count, const T* q, const T* qd, const T* qdd, T* tau, int threads);

  void mass(const T* q, T* M) {
    need(Want::mass);
    if (whole_) return whole_->mass(q, M);
    std::fill_n(M, std::ptrdiff_t(asked_) * asked_, T(0));
    for (PartState<T>& p : parts_) {
      p.gather_q(q);
      p.engine->mass(p.q.data(), p.X.data());
      p.asked.block(p.X.data(), p.nv, M, asked_);
    }
  }

  Outcome inverse(const T* q, T* X) {
    need(Want::inverse);
    if (whole_) return whole_->inverse(q, X);
    std::fill_n(X, std::ptrdiff_t(asked_) * asked_, T(0));
    return each([&](PartState<T>& p) {
      p.gather_q(q);
      if (p.block) {
        const Outcome outcome = p.engine->selected(p.q.data(), p.selection.data());
        p.block_out.block(p.selection.data(), p.selected, X, asked_);
        return outcome;
      }
      const Outcome outcome = p.engine->inverse(p.q.data(), p.X.data());
      p.asked.block(p.X.data(), p.nv, X, asked_);
      return outcome;
    });
  }

  // Rows of M, M^-1 and M^-1 tau: M and X have a matrix, tau and x asked_ numbers a row.
  int mass(int count, const T* q, T* M, Outcome* outcomes, int threads);

  int inverse(int count, const T* q, T* X, Outcome* outcomes, int threads);

  int solve(int count, const T* q, const T* tau, T* x, Outcome* outcomes, int threads);

  // Rows of parts of M^-1 and of derivatives; of the latter null: not asked for.
  int diagonal(int count, const T* q, T* x, Outcome* outcomes, int threads);
  int log_det(int count, const T* q, T* x, Outcome* outcomes, int threads);
  int operational(int count, const T* q, T* X, Outcome* outcomes, int threads);
  int derivatives(int count, const T* q, const T* qd, const T* tau, T* dq, T* dqd, T* dtau, T* a,
                  Outcome* outcomes, int threads);

  Outcome factor(const T* q) {
    need(Want::solve);
    std::copy_n(q, nq_, factored_q_.data());
    factor_again();
    return kept_;
  }

  // Torques of joints that are not asked about are zero. NaN after a factorisation that failed.
  Outcome solve(int columns, const T* taus, T* X) {
    need(Want::solve);
    if (factors_ == Kept::none) throw std::logic_error("solve: nothing has been factored");
    if (factors_ == Kept::overwritten) factor_again();
    if (!kept_) {
      std::fill_n(X, std::ptrdiff_t(columns) * asked_, std::numeric_limits<T>::quiet_NaN());
      return kept_;
    }
    return whole_ ? whole_->solve(columns, taus, X) : solve_parts(columns, taus, X, kept_);
  }

  Outcome diagonal(const T* q, T* x) {
    need(Want::diagonal);
    return each([&](PartState<T>& p) {
      p.gather_q(q);
      Outcome outcome;
      if (p.in_part) {
        outcome = p.engine->diagonal(p.q.data(), p.a.data());
      } else {
        outcome = p.engine->inverse(p.q.data(), p.X.data());
        p.a = p.X.diagonal();
      }
      p.asked(p.a.data(), x);
      return outcome;
    });
  }

  Outcome log_det(const T* q, T& x) {
    need(Want::log_det);
    x = T(0);
    return each([&](PartState<T>& p) {
      p.gather_q(q);
      T part(0);
      const Outcome outcome =
          p.sums_D ? p.engine->log_det(p.q.data(), part) : p.log_det_by_cholesky(part);
      x += part;
      return outcome;
    });
  }

  Outcome operational(const T* q, T* X) {
    need(Want::operational);
    std::fill_n(X, std::ptrdiff_t(rows_) * rows_, T(0));
    return each([&](PartState<T>& p) {
      if (p.sites.empty()) return Outcome{};
      p.gather_q(q);
      if (p.in_part) {
        const Outcome outcome = p.engine->selected(p.q.data(), p.selection.data());
        p.frames_out.block(p.selection.data(), p.selected, X, rows_);
        return outcome;
      }
      const Outcome outcome = p.engine->inverse(p.q.data(), p.X.data());
      set_position(p.kinematics->model, p.q, p.kinematics->kin);
      site_jacobian<T>(p.kinematics->model, p.kinematics->kin, p.sites, p.J);
      p.XJ.noalias() = p.X * p.J.transpose();
      p.selection.noalias() = p.J * p.XJ;
      p.frames_out.block(p.selection.data(), p.selected, X, rows_);
      return outcome;
    });
  }

  // Null: not asked for.
  Outcome derivatives(const T* q, const T* qd, const T* tau, T* dq, T* dqd, T* dtau, T* a) {
    need(Want::derivatives);
    T* results[] = {dq, dqd, dtau};
    if (whole_) {
      for (int i = 0; i < 3; ++i)
        if (!results[i]) results[i] = unwanted(i);
      return whole_->derivatives(q, at_rest_ ? zero_.data() : qd, tau, results[0], results[1],
                                 results[2], a);
    }
    for (T* X : results)
      if (X) std::fill_n(X, std::ptrdiff_t(asked_) * asked_, T(0));
    return each([&](PartState<T>& p) {
      p.gather(q, qd, tau);
      const Outcome outcome = p.engine->derivatives(
          p.q.data(), p.qd.data(), p.tau_or_qdd.data(), p.derivatives[0].data(),
          p.derivatives[1].data(), p.derivatives[2].data(), p.a.data());
      p.asked(p.a.data(), a);
      for (int i = 0; i < 3; ++i)
        if (results[i]) p.asked.block(p.derivatives[i].data(), p.nv, results[i], asked_);
      return outcome;
    });
  }

 private:
  static constexpr int wants = static_cast<int>(Want::derivatives) + 1;
  static constexpr unsigned bit(Want want) { return 1u << static_cast<int>(want); }
  [[noreturn]] static void refuse(Want what) {
    throw std::logic_error(std::string("the question does not want ") + to_string(what));
  }
  // What engines work out they may leave where their factors stood.
  void need(Want what) {
    if (!(wanted_ & bit(what))) refuse(what);
    if (what != Want::solve && what != Want::mass && what != Want::inverse_dynamics)
      overwrite_factors();
  }

  void overwrite_factors() {
    if (factors_ == Kept::there) factors_ = Kept::overwritten;
  }

  void factor_again() {
    factors_ = Kept::there;
    kept_ = whole_ ? whole_->factor(factored_q_.data()) : factor_parts(factored_q_.data());
  }

  Outcome factor_parts(const T* q) {
    return each([&](PartState<T>& p) {
      p.gather_q(q);
      return p.engine->factor(p.q.data());
    });
  }

  // out: of what came before.
  Outcome solve_parts(int columns, const T* taus, T* X, Outcome out) {
    for (PartState<T>& p : parts_)
      for (int j = 0; j < columns; ++j) {
        const std::ptrdiff_t start = std::ptrdiff_t(j) * asked_;
        p.tau_or_qdd.setZero();
        p.asked.back(taus + start, p.tau_or_qdd.data());
        out = worse(out, p.of_whole(p.engine->solve(1, p.tau_or_qdd.data(), p.a.data())));
        p.asked(p.a.data(), X + start);
      }
    return out;
  }

  // M^-1 tau at q; no factors are kept.
  Outcome solve_at(const T* q, const T* tau, T* x) {
    overwrite_factors();
    const Outcome of_D = whole_ ? whole_->factor(q) : factor_parts(q);
    if (!of_D) return of_D;
    return whole_ ? whole_->solve(1, tau, x) : solve_parts(1, tau, x, of_D);
  }

  // Rows of a matrix, by what call(engine, rows) fills of every part.
  template <class Call>
  void matrices_of_parts(Want what, int worker, std::ptrdiff_t first, int states, const T* q, T* X,
                         Outcome* outcomes, const Call& call);

  // Rows of a vector, by what call(part, rows) fills of every part.
  template <class Call>
  void vectors_of_parts(int worker, std::ptrdiff_t first, int states, const T* q, T* x,
                        Outcome* outcomes, const Call& call);

  // All pointers at the first of the rows, which are at most PartState::rows_at_once.
  void operational_of_parts(int worker, int states, const T* q, T* X, Outcome* outcomes,
                            char* left_over);
  void derivatives_of_parts(int worker, int states, const T* q, const T* qd, const T* tau,
                            T* const X[3], T* a, Outcome* outcomes, char* left_over);

  // Of rows that parts answer: the outcome of all is the worst of them.
  static void begin_rows(int states, Outcome* outcomes, char* left_over) {
    std::fill_n(outcomes, states, Outcome{});
    std::fill_n(left_over, states, char(0));
  }
  static void merge(const PartState<T>& p, const typename PartState<T>::Rows& rows,
                    std::ptrdiff_t row, Outcome& outcome, char& left_over) {
    left_over |= rows.left_over[row];
    if (!left_over && outcome) outcome = worse(outcome, p.of_whole(rows.outcomes[row]));
  }

  bool answers_in_part() const {
    return std::all_of(parts_.begin(), parts_.end(),
                       [](const PartState<T>& p) { return p.in_part; });
  }

  // Rows of `what`: in_lanes(worker, first, states) answers those that it does not leave over,
  // one(execution, row) of the worker's own execution the rest. Returns how many failed.
  template <class InLanes, class One>
  int answer_rows(Want what, int count, Outcome* outcomes, int threads, const InLanes& in_lanes,
                  const One& one);

  int failed() const {
    int sum = 0;
    for (const int one : failed_) sum += one;
    return sum;
  }

  // f(part) of all, until one fails.
  template <class F>
  Outcome each(const F& f) {
    Outcome out;
    for (PartState<T>& p : parts_) {
      const Outcome outcome = p.of_whole(f(p));
      if (!outcome) return outcome;
      out = worse(out, outcome);
    }
    return out;
  }

  // Memory for rows on so many cores; more than before allocate it.
  void reserve(Want what, int threads);

  // Of workers beyond the first: what answers one state after another.
  std::vector<std::unique_ptr<Execution>>& others(Want what) {
    return others_[static_cast<int>(what)];
  }

  // f(worker, first, states) of blocks of rows.
  template <class F>
  void for_each_block(int count, int threads, const F& f);

  // Where a derivative goes that is not asked for.
  T* unwanted(int i) {
    if (spare_[i].size() == 0) spare_[i].resize(asked_, asked_);
    return spare_[i].data();
  }

  Plan plan_;
  double tolerance_;
  MakeEngine<T> make_;
  int nq_, asked_, rows_;
  bool at_rest_;
  unsigned wanted_ = 0;  // bits: a lookup in the question's set is 5 ns of every call
  std::vector<T> zero_;  // velocities of a robot at rest
  std::vector<T> factored_q_;
  enum class Kept { none, there, overwritten } factors_ = Kept::none;
  Outcome kept_;  // of them
  MatrixX<T> spare_[3];
  std::vector<PartState<T>> parts_;
  Engine<T>* whole_ = nullptr;        // where nothing is left out but by the engine itself
  std::array<int, wants> workers_{};  // for which there is memory for rows
  std::array<std::vector<std::unique_ptr<Execution>>, wants> others_;
  std::vector<int> failed_;
  std::vector<char> left_over_;  // rows that one state at a time is asked of
  Threads threads_;
};

}  // namespace kalmarm
