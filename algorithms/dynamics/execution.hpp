// Executes a plan: gathers each part's state from the robot's, asks the part's engine, scatters the
// result. Engines, memory and what is copied where are settled when the object is made; memory for rows
// by the first call for them.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/dynamics/is_body.hpp"
#include "algorithms/dynamics/part_state.hpp"
#include "algorithms/dynamics/threads.hpp"

namespace kalmarm {

// Only what the question wants may be asked: else std::logic_error. Calls hold the pointers of Dynamics,
// whose header says what they point to.
template <class T>
class Execution {
 public:
  Execution(Plan plan, int nq, double tolerance, Triangles triangles, const MakeEngine<T>& make)
      : plan_(std::move(plan)),
        width_(nq, plan_.nv, std::ssize(plan_.asked), 6 * std::ssize(plan_.question.frames),
               {plan_.question.acted_on, plan_.question.contacts, plan_.question.loaded}),
        at_rest_(plan_.question.at_rest),
        zero_(plan_.nv, T(0)),
        factored_(width_) {
    for (const Want want : plan_.question.want) wanted_ |= bit(want);
    const bool nothing_to_copy = plan_.parts.size() == 1 && width_.n == plan_.nv &&
                                 plan_.parts[0].reduction.model.nv() == plan_.nv &&
                                 first_has_all_frames() && plan_.question.locked.empty();
    // What is copied is copied whole.
    if (!nothing_to_copy) triangles = Triangles::both;
    fills_lower_ = triangles == Triangles::lower;
    for (const Part& part : plan_.parts)
      parts_.emplace_back(plan_, part, tolerance, triangles, make);
    if (nothing_to_copy) whole_ = &parts_[0].engine();
    for (const Want want : plan_.question.want) {
      // Frames of a part may stand in another order than the question's.
      if (whole_ && !is_of_frames(want) && parts_[0].asks_engine(want)) direct_ |= bit(want);
      for (PartState<T>& p : parts_)
        if (!(direct_ & bit(want))) p.reserve(want, 1, 1);
    }
  }

  const Plan& plan() const { return plan_; }
  const Widths& width() const { return width_; }

  // One state. qd and tau of inverse dynamics: null where they are zero.
  Outcome answer(const Call<T>& given) {
    need(given);
    Call<T> call = given;
    const bool of_torques = call.want == Want::inverse_dynamics;
    if (at_rest_ || (of_torques && !call.qd)) call.qd = zero_.data();
    if (of_torques && !call.tau) call.tau = zero_.data();
    if (const Outcome of_loads = judge_loads(call); !of_loads) return of_loads;
    if (direct_ & bit(call.want)) return whole_->answer(call);
    if (call.B) return with_columns(call);
    clear(1, call);
    return each([&](PartState<T>& p) { return p.answer(call, width_); });
  }

  // Rows of states, an outcome each, but for inverse dynamics; returns how many failed. One row is one
  // state, which takes less time than lanes (of M^-1 of g1 a half); two are faster in lanes. Joint noise
  // of rows is for lanes: of one state two doubles answer it.
  int answer_rows(int count, const Call<T>& call, Outcome* outcomes, int threads) {
    const int failed = failures_of_rows(count, call, outcomes, threads);
    if (fills_lower_ && (call.want == Want::mass || call.want == Want::inverse))
      for (int i = 0; i < count; ++i) mirror(call.out + i * width_.n * width_.n);
    return failed;
  }

  // At call.q, with contacts and loads where there are some.
  Outcome factor(const Call<T>& call) {
    need({.want = Want::solve});
    factored_.keep(call);
    factor_again();
    return kept_;
  }

  // Torques of joints that are not asked about are zero. NaN after a factorisation that failed.
  Outcome solve(int columns, const T* taus, T* X) {
    if (!(wanted_ & bit(Want::solve))) refuse(Want::solve);
    if (factors_ == Kept::none) throw std::logic_error("solve: nothing has been factored");
    if (factors_ == Kept::overwritten) factor_again();
    if (!kept_) {
      std::fill_n(X, columns * width_.n, std::numeric_limits<T>::quiet_NaN());
      return kept_;
    }
    return whole_ ? whole_->solve(columns, taus, X) : solve_parts(columns, taus, X, kept_);
  }

 private:
  static constexpr int wants = static_cast<int>(Want::derivatives) + 1;
  static constexpr int most_rows_of_a_worker = 64;
  static constexpr unsigned bit(Want want) { return 1u << static_cast<int>(want); }
  [[noreturn]] static void refuse(Want what) {
    throw std::logic_error(std::string("the question does not want ") + to_string(what));
  }

  int failures_of_rows(int count, const Call<T>& call, Outcome* outcomes, int threads) {
    if (count == 1 && !call.r) {
      const Outcome outcome = answer(call);
      if (outcomes) *outcomes = outcome;
      return outcomes && !outcome;
    }
    need(call);
    const bool direct = (direct_ & bit(call.want)) && !at_rest_;
    if (call.B && !direct) return one_by_one(count, call, outcomes);
    const int at_once = reserve(call.want, direct, threads);
    failed_.assign(threads, 0);
    const auto block = [&](int worker, std::ptrdiff_t first, int states) {
      const Call<T> rows = call.from(first, width_);
      Outcome* const of_rows = outcomes ? outcomes + first : nullptr;
      if (direct) {
        whole_->answer_rows(worker, states, rows, of_rows);
      } else {
        if (outcomes) std::fill_n(of_rows, states, Outcome{.rung = Outcome::Rung::float_lanes});
        clear(states, rows);
        for (PartState<T>& p : parts_) p.answer_rows(worker, states, rows, width_, of_rows);
      }
      if (outcomes && call.loads)
        for (int i = 0; i < states; ++i)
          if (const Outcome one = judge_loads(rows.from(i, width_)); !one) of_rows[i] = one;
      if (outcomes) failed_[worker] += failures(states, of_rows);
    };
    const int largest = direct && threads == 1 ? std::max(count, 1) : at_once;
    const int blocks = (count + largest - 1) / largest;
    const auto one = [&](int worker, int i) {
      block(worker, std::ptrdiff_t(i) * largest, std::min(largest, count - i * largest));
    };
    if (threads == 1)
      for (int i = 0; i < blocks; ++i) one(0, i);
    else
      threads_.run(threads, blocks, one);
    int failed = 0;
    for (const int of_worker : failed_) failed += of_worker;
    return failed;
  }

  // The upper triangle of the lower one, of rows that engines answer as they do one state.
  void mirror(T* X) const {
    for (std::ptrdiff_t j = 0; j < width_.n; ++j)
      for (std::ptrdiff_t i = 0; i < j; ++i) X[j * width_.n + i] = X[i * width_.n + j];
  }

  // Whether the first part has all frames of calls: none is on the base.
  bool first_has_all_frames() const {
    const CallFrames& of_part = plan_.parts[0].of_calls;
    return of_part.acted_on.size() == plan_.question.acted_on.size() &&
           of_part.contacts.size() == plan_.question.contacts.size() &&
           of_part.loaded.size() == plan_.question.loaded.size();
  }

  // What engines work out they may leave where their factors stood.
  void need(const Call<T>& call) {
    if (!(wanted_ & bit(call.want))) refuse(call.want);
    if (call.B && !(wanted_ & bit(Want::solve))) refuse(Want::solve);
    if (call.want != Want::mass && call.want != Want::inverse_dynamics && factors_ == Kept::there)
      factors_ = Kept::overwritten;
  }

  // What parts add to, or leave out.
  void clear(int states, const Call<T>& call) const {
    switch (call.want) {
      case Want::mass:
      case Want::inverse:
      case Want::log_det:
      case Want::operational:
      case Want::operational_diagonal:
        std::fill_n(call.out, states * width_.out(call.want), T(0));
        return;
      default:
        for (T* const X : call.derivatives)
          if (X) std::fill_n(X, states * width_.n * width_.n, T(0));
    }
  }

  void factor_again() {
    factors_ = Kept::there;
    const Call<T>& call = factored_.call();
    kept_ = judge_loads(call);
    if (kept_) kept_ = whole_ ? whole_->factor(call) : factor_parts(call);
  }

  // Of one state: what is made of factors needs bodies that can be, of which all bounds of rounding are.
  Outcome judge_loads(const Call<T>& call) const {
    if (!call.loads || call.want == Want::mass || call.want == Want::inverse_dynamics) return {};
    for (std::size_t i = 0; i < plan_.question.loaded.size(); ++i)
      if (!is_body(call.loads + numbers_of_load * i))
        return {.status = Outcome::Status::indefinite, .joint = plan_.question.loaded[i].link};
    return {};
  }

  Outcome factor_parts(const Call<T>& call) {
    return each([&](PartState<T>& p) { return p.factor(call, width_); });
  }

  // out: of what came before.
  Outcome solve_parts(int columns, const T* taus, T* X, Outcome out) {
    for (PartState<T>& p : parts_)
      for (int j = 0; j < columns; ++j)
        out = worse(out, p.solve(taus + j * width_.n, X + j * width_.n));
    return out;
  }

  Outcome with_columns(const Call<T>& call) {
    Call<T> of_a = call;
    of_a.B = nullptr;
    const Outcome out = answer(of_a);
    const Outcome of_D =
        out ? factor_parts({.want = Want::solve, .q = call.q, .loads = call.loads}) : out;
    return of_D ? solve_parts(call.m, call.B, call.X, worse(out, of_D)) : of_D;
  }

  int one_by_one(int count, const Call<T>& call, Outcome* outcomes) {
    for (int i = 0; i < count; ++i) outcomes[i] = answer(call.from(i, width_));
    return failures(count, outcomes);
  }

  static int failures(int count, const Outcome* outcomes) {
    return static_cast<int>(
        std::count_if(outcomes, outcomes + count, [](const Outcome& one) { return !one; }));
  }

  // f(part) of all, until one fails.
  template <class F>
  Outcome each(const F& f) {
    Outcome out;
    for (PartState<T>& p : parts_) {
      const Outcome outcome = f(p);
      if (!outcome) return outcome;
      out = worse(out, outcome);
    }
    return out;
  }

  // Memory for rows on so many cores; more than before allocate it. Returns how many rows a worker
  // takes at once.
  int reserve(Want want, bool direct, int threads) {
    int at_once = most_rows_of_a_worker;
    if (!direct)
      for (const PartState<T>& p : parts_) at_once = std::min(at_once, p.states_at_once(want));
    int& workers = workers_[static_cast<int>(want)];
    if (threads <= workers) return at_once;
    workers = threads;
    for (PartState<T>& p : parts_) {
      p.reserve_engine(want, threads);
      if (!direct) p.reserve(want, threads, at_once);
    }
    return at_once;
  }

  Plan plan_;
  Widths width_;
  bool at_rest_, fills_lower_ = false;
  // Bits: a lookup in the question's set is 5 ns of every call.
  unsigned wanted_ = 0, direct_ = 0;  // direct: nothing is copied
  std::vector<T> zero_;               // velocities of a robot at rest
  KeptPosition<T> factored_;
  enum class Kept { none, there, overwritten } factors_ = Kept::none;
  Outcome kept_;  // of them
  std::vector<PartState<T>> parts_;
  Engine<T>* whole_ = nullptr;        // where one part is all there is
  std::array<int, wants> workers_{};  // for which there is memory for rows
  std::vector<int> failed_;           // of every worker
  Threads threads_;
};

}  // namespace kalmarm
