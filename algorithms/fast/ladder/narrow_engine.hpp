// Engines in float are two rungs of a ladder. Rows of states are answered by float's kernels, a state in
// every lane, where the sums of a lane say that its answer can be used (engine/acceptance.hpp). All else
// is answered in double and rounded: the rows that lanes leave over, gathered, in lanes of double, and
// every call of one state, which takes about as long in double.
//
// Parameters are rounded to float in lanes alone: double has them as they are given. The error of what
// double answers is double's and that of rounding the answer, in Euclid's norm.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <vector>

#include "algorithms/fast/engine/acceleration_rows.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/rows_in_lanes.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/spatial/flush_subnormals.hpp"

namespace kalmarm {

// F: of the lanes' accelerations.
template <class F>
class NarrowEngine final : public Engine<float> {
  using Wide = Engine<double>;

 public:
  template <class MakeWide>
  NarrowEngine(const RobotModel& robot, const EngineOptions& options, const MakeWide& make_wide)
      : model_(model_of(robot).template cast<float>()),
        lowered_(model_, options.zeros, accepted_error(options.tolerance)),
        acceptance_(robot, lowered_, options.tolerance),
        rows_(lowered_, acceptance_, options.selection),
        accelerations_(lowered_, acceptance_, options.wants(Want::solve)),
        in_lanes_(options.tolerance >= least_tolerance_of_float &&
                  (options.kernel == Kernel::spatial || options.kernel == Kernel::spatial_at_rest)),
        lower_(options.triangles == Triangles::lower),
        wide_(make_wide(robot, in_double(options))),
        selected_(options.selection.size()),
        columns_(nv() * most_columns) {
    const auto wants = [&](Want want) { return options.wants(want); };
    const bool matrices = wants(Want::inverse) || wants(Want::mass);
    std::size_t numbers = std::max(nv() * most_columns, selected_ * selected_);
    if (matrices) numbers = std::max(numbers, nv() * nv());
    if (wants(Want::derivatives)) numbers = std::max(numbers, 3 * nv() * nv() + nv());
    one_ = Numbers(nq() + 2 * nv(), numbers);
  }

  bool answers_in_part() const override { return wide_->answers_in_part(); }

  // --- one state, in double

  Outcome forward_dynamics(const float* q, const float* qd, const float* tau, float* a) override {
    const auto [in_q, in_qd, in_tau] = widened(q, qd, tau);
    const Outcome out = wide_->forward_dynamics(in_q, in_qd, in_tau, one_.out.data());
    return rounded_motion(out, one_.out.data(), a);
  }

  Outcome forward_dynamics(const float* q, const float* qd, const float* tau, float* a, int m,
                           const float* B, float* X) override {
    const auto [in_q, in_qd, in_tau] = widened(q, qd, tau);
    const std::size_t size = nv() * m;
    columns_.resize(std::max(columns_.size(), size));
    std::copy_n(B, size, columns_.data());
    X_.resize(std::max(X_.size(), size));
    const Outcome out = wide_->forward_dynamics(in_q, in_qd, in_tau, one_.out.data(), m,
                                                columns_.data(), X_.data());
    return rounded(rounded_motion(out, one_.out.data(), a), size, X_.data(), X, 0);
  }

  void inverse_dynamics(const float* q, const float* qd, const float* qdd, float* tau) override {
    const auto [in_q, in_qd, in_qdd] = widened(q, qd, qdd);
    wide_->inverse_dynamics(in_q, in_qd, in_qdd, one_.out.data());
    round(nv(), one_.out.data(), tau);
  }

  void mass(const float* q, float* M) override {
    wide_->mass(widened(q), one_.out.data());
    round_matrix(one_.out.data(), M);
  }

  Outcome inverse(const float* q, float* X) override {
    Outcome out = wide_->inverse(widened(q), one_.out.data());
    const FlushSubnormals flush;
    if (!round_matrix(one_.out.data(), X) && out) return {.status = Outcome::Status::not_finite};
    out.error += unit_roundoff<float>();
    return out;
  }
  Outcome diagonal(const float* q, float* x) override {
    return rounded(wide_->diagonal(widened(q), one_.out.data()), nv(), one_.out.data(), x);
  }
  Outcome log_det(const float* q, float& x) override {
    return rounded(wide_->log_det(widened(q), one_.out[0]), 1, one_.out.data(), &x);
  }
  Outcome selected(const float* q, float* X) override {
    return rounded(wide_->selected(widened(q), one_.out.data()), selected_ * selected_,
                   one_.out.data(), X);
  }

  Outcome factor(const float* q) override { return wide_->factor(widened(q)); }

  Outcome solve(int columns, const float* taus, float* X) override {
    Outcome out;
    for (int first = 0; first < columns; first += most_columns) {
      const int m = std::min(most_columns, columns - first);
      const std::size_t at = first * nv(), size = nv() * m;
      std::copy_n(taus + at, size, columns_.data());
      const Outcome of_some = wide_->solve(m, columns_.data(), one_.out.data());
      out = first > 0 ? worse(out, rounded(of_some, size, one_.out.data(), X + at))
                      : rounded(of_some, size, one_.out.data(), X + at);
    }
    return out;
  }

  Outcome derivatives(const float* q, const float* qd, const float* tau, float* da_dq,
                      float* da_dqd, float* da_dtau, float* a) override {
    const auto [in_q, in_qd, in_tau] = widened(q, qd, tau);
    const std::size_t size = nv() * nv();
    double* const X = one_.out.data();
    Outcome out = wide_->derivatives(in_q, in_qd, in_tau, X, X + size, X + 2 * size, X + 3 * size);
    out = rounded(out, size, X, da_dq);
    out = rounded(out, size, X + size, da_dqd, 0);
    out = rounded(out, size, X + 2 * size, da_dtau, 0);
    return rounded(out, nv(), X + 3 * size, a, 0);
  }

  // --- rows, in lanes of float, and what these leave over in lanes of double

  void reserve_workers(Want what, int count) override {
    wide_->reserve_workers(what, count);
    if (in_lanes_ && what == Want::acceleration) accelerations_.reserve(count);
    if (in_lanes_ || what == Want::inverse_dynamics || what == Want::mass)
      rows_.reserve(what, count);
    const std::size_t square = nv() * nv(), numbers = what == Want::derivatives ? 3 * square + nv()
                                                      : what == Want::mass || what == Want::inverse
                                                          ? square
                                                          : std::max(nv(), selected_ * selected_);
    while (static_cast<int>(climbs_.size()) < count) climbs_.emplace_back();
    for (int i = 0; i < count; ++i) climbs_[i].reserve(nq() + 3 * nv(), numbers);
  }

  int forward_dynamics(int worker, int count, const float* q, const float* qd, const float* tau,
                       float* a, Outcome* outcomes) override {
    Climb& climb = climbs_[worker];
    climb.begin(count);
    if (in_lanes_)
      accelerations_.forward_dynamics(worker, count, q, qd, tau, a, outcomes,
                                      climb.left_over.data());
    int failed = 0;
    climb.rows(
        count, climb.left_over.data(), {{q, nq()}, {qd, nv()}, {tau, nv()}},
        [&](int n, double* const* in) {
          wide_->forward_dynamics(worker, n, in[0], in[1], in[2], climb.out.data(),
                                  climb.outcomes.data());
        },
        [&](int i, int row) {
          outcomes[row] =
              rounded_motion(climb.outcomes[i], climb.out.data() + i * nv(), a + row * nv());
          outcomes[row] = climbed(outcomes[row], true);
          failed += !outcomes[row];
          return true;
        });
    return failed;
  }

  void forward_dynamics(int worker, int count, const float* q, const float* qd, const float* tau,
                        float* a, Outcome* outcomes, int m, const float* B, float* X,
                        char* left_over) override {
    std::fill_n(left_over, count, char(1));
    if (in_lanes_)
      accelerations_.forward_dynamics(worker, count, q, qd, tau, a, outcomes, m, B, X, left_over);
    if (std::find(left_over, left_over + count, char(1)) == left_over + count) return;
    const std::size_t size = nv() * m;
    Climb& climb = climbs_[worker];
    climb.B.assign(B, B + size);
    climb.X.resize(std::max(climb.X.size(), rows_at_once * size));
    climb.rows(
        count, left_over, {{q, nq()}, {qd, nv()}, {tau, nv()}},
        [&](int n, double* const* in) {
          wide_->forward_dynamics(worker, n, in[0], in[1], in[2], climb.out.data(),
                                  climb.outcomes.data(), m, climb.B.data(), climb.X.data(),
                                  climb.still_left.data());
        },
        [&](int i, int row) {
          const Outcome of_a =
              rounded_motion(climb.outcomes[i], climb.out.data() + i * nv(), a + row * nv());
          outcomes[row] = climbed(of_a, round(size, climb.X.data() + i * size, X + row * size));
          return true;
        });
  }

  void forward_dynamics(int worker, int count, const float* q, const float* qd, const float* tau,
                        const float* r, float* a, Outcome* outcomes, char* left_over) override {
    if constexpr (!F::at_rest) {
      std::fill_n(left_over, count, char(1));
      if (!in_lanes_) return;
      accelerations_.forward_dynamics(worker, count, q, qd, tau, r, a, outcomes, left_over);
      Climb& climb = climbs_[worker];
      climb.rows(
          count, left_over, {{q, nq()}, {qd, nv()}, {tau, nv()}, {r, nv()}},
          [&](int n, double* const* in) {
            wide_->forward_dynamics(worker, n, in[0], in[1], in[2], in[3], climb.out.data(),
                                    climb.outcomes.data(), climb.still_left.data());
          },
          [&](int i, int row) {
            outcomes[row] = climbed(
                rounded_motion(climb.outcomes[i], climb.out.data() + i * nv(), a + row * nv()),
                true);
            return true;
          });
    } else {
      Engine::forward_dynamics(worker, count, q, qd, tau, r, a, outcomes, left_over);
    }
  }

  void inverse_dynamics(int worker, int count, const float* q, const float* qd, const float* qdd,
                        float* tau) override {
    rows_.inverse_dynamics(worker, count, q, qd, qdd, tau);
  }

  void mass(int worker, int count, const float* q, float* M, Outcome* outcomes,
            char* left_over) override {
    rows_.mass(worker, count, q, M, outcomes, left_over);
  }

  void inverse(int worker, int count, const float* q, float* X, Outcome* outcomes,
               char* left_over) override {
    rows_.inverse(worker, count, q, X, outcomes, left_over);
    const FlushSubnormals flush;
    climb(worker, count, {{q, nq()}}, nv() * nv(), X, outcomes, left_over,
          [&](int n, double* const* in, double* out, Outcome* of, char* left) {
            wide_->inverse(worker, n, in[0], out, of, left);
          });
  }

  void solve(int worker, int count, const float* q, const float* tau, float* x, Outcome* outcomes,
             char* left_over) override {
    rows_.solve(worker, count, q, tau, x, outcomes, left_over);
    climb(worker, count, {{q, nq()}, {tau, nv()}}, nv(), x, outcomes, left_over,
          [&](int n, double* const* in, double* out, Outcome* of, char* left) {
            wide_->solve(worker, n, in[0], in[1], out, of, left);
          });
  }

  void diagonal(int worker, int count, const float* q, float* x, Outcome* outcomes,
                char* left_over) override {
    rows_.diagonal(worker, count, q, x, outcomes, left_over);
    climb(worker, count, {{q, nq()}}, nv(), x, outcomes, left_over,
          [&](int n, double* const* in, double* out, Outcome* of, char* left) {
            wide_->diagonal(worker, n, in[0], out, of, left);
          });
  }

  void log_det(int worker, int count, const float* q, float* x, Outcome* outcomes,
               char* left_over) override {
    rows_.log_det(worker, count, q, x, outcomes, left_over);
    climb(worker, count, {{q, nq()}}, 1, x, outcomes, left_over,
          [&](int n, double* const* in, double* out, Outcome* of, char* left) {
            wide_->log_det(worker, n, in[0], out, of, left);
          });
  }

  void selected(int worker, int count, const float* q, float* X, Outcome* outcomes,
                char* left_over) override {
    rows_.selected(worker, count, q, X, outcomes, left_over);
    climb(worker, count, {{q, nq()}}, selected_ * selected_, X, outcomes, left_over,
          [&](int n, double* const* in, double* out, Outcome* of, char* left) {
            wide_->selected(worker, n, in[0], out, of, left);
          });
  }

  void derivatives(int worker, int count, const float* q, const float* qd, const float* tau,
                   float* da_dq, float* da_dqd, float* da_dtau, float* a, Outcome* outcomes,
                   char* left_over) override {
    rows_.derivatives(worker, count, q, qd, tau, da_dq, da_dqd, da_dtau, a, outcomes, left_over);
    const std::size_t size = nv() * nv();
    Climb& climb = climbs_[worker];
    double* const out = climb.out.data();
    double* const X[] = {out, out + rows_at_once * size, out + 2 * rows_at_once * size};
    double* const of_a = out + 3 * rows_at_once * size;
    climb.rows(
        count, left_over, {{q, nq()}, {qd, nv()}, {tau, nv()}},
        [&](int n, double* const* in) {
          wide_->derivatives(worker, n, in[0], in[1], in[2], da_dq ? X[0] : nullptr,
                             da_dqd ? X[1] : nullptr, da_dtau ? X[2] : nullptr, of_a,
                             climb.outcomes.data(), climb.still_left.data());
        },
        [&](int i, int row) {
          bool finite = round(nv(), of_a + i * nv(), a + row * nv());
          float* const to[] = {da_dq, da_dqd, da_dtau};
          for (int j = 0; j < 3; ++j)
            if (to[j]) finite &= round(size, X[j] + i * size, to[j] + row * size);
          outcomes[row] = climbed(climb.outcomes[i], finite);
          return true;
        });
  }

 private:
  // Double gives its own default at no price.
  static EngineOptions in_double(EngineOptions options) {
    options.tolerance = std::min(options.tolerance, default_tolerance<double>);
    return options;
  }

  static constexpr int most_columns = FactorSolver<double>::lanes;
  // Of rows that climb: some blocks of lanes.
  static constexpr int rows_at_once = 4 * RowBlock<double>::lanes;

  struct Numbers {
    std::vector<double> in, out;

    Numbers() = default;
    Numbers(std::size_t of_in, std::size_t of_out) : in(of_in), out(of_out) {}
  };

  struct Input {
    const float* rows;
    std::size_t width;
  };

  // Rows of a worker that lanes of float have left over, gathered in double.
  struct Climb : Numbers {
    std::vector<char> left_over;   // of all rows
    std::vector<char> still_left;  // these of those that are gathered
    std::vector<Outcome> outcomes;
    std::vector<int> gathered;
    std::vector<double> B, X;  // of columns, from the first call with them on

    // Numbers a row.
    void reserve(std::size_t of_in, std::size_t of_out) {
      this->in.resize(std::max(this->in.size(), rows_at_once * of_in));
      this->out.resize(std::max(this->out.size(), rows_at_once * of_out));
      still_left.resize(rows_at_once);
      outcomes.resize(rows_at_once);
      gathered.reserve(rows_at_once);
    }

    void begin(int count) { left_over.assign(count, 1); }

    // ask(n, in) of every n rows that are left over, in[i]: those of input i; then of every row that
    // it does not leave, take(i, row) says whether gathered row i is answered.
    template <class Ask, class Take>
    void rows(int count, char* left, std::initializer_list<Input> inputs, const Ask& ask,
              const Take& take) {
      for (int next = 0; next < count;) {
        gathered.clear();
        for (; next < count && static_cast<int>(gathered.size()) < rows_at_once; ++next)
          if (left[next]) gathered.push_back(next);
        if (gathered.empty()) return;
        double* in[4] = {};
        double* to = this->in.data();
        int i = 0;
        for (const Input& input : inputs) {
          in[i++] = to;
          for (const int row : gathered)
            to = std::copy_n(input.rows + row * input.width, input.width, to);
        }
        const int n = static_cast<int>(gathered.size());
        std::fill_n(still_left.data(), n, char(0));
        ask(n, in);
        for (int j = 0; j < n; ++j)
          if (!still_left[j]) left[gathered[j]] = !take(j, gathered[j]);
      }
    }
  };

  std::size_t nq() const { return lowered_.nq(); }
  std::size_t nv() const { return lowered_.nv(); }

  // Rows of one result, `width` numbers each.
  template <class Ask>
  void climb(int worker, int count, std::initializer_list<Input> inputs, std::size_t width,
             float* to, Outcome* outcomes, char* left_over, const Ask& ask) {
    Climb& climb = climbs_[worker];
    climb.rows(
        count, left_over, inputs,
        [&](int n, double* const* in) {
          ask(n, in, climb.out.data(), climb.outcomes.data(), climb.still_left.data());
        },
        [&](int i, int row) {
          const bool finite = round(width, climb.out.data() + i * width, to + row * width);
          outcomes[row] = climbed(climb.outcomes[i], finite);
          return true;
        });
  }

  const double* widened(const float* q) {
    std::copy_n(q, nq(), one_.in.data());
    return one_.in.data();
  }
  std::array<const double*, 3> widened(const float* q, const float* qd, const float* tau) {
    double* const to_qd = std::copy_n(q, nq(), one_.in.data());
    double* const to_tau = std::copy_n(qd, nv(), to_qd);
    std::copy_n(tau, nv(), to_tau);
    return {one_.in.data(), to_qd, to_tau};
  }

  // Whether all of it is finite.
  static bool round(std::size_t count, const double* from, float* to) {
    float check = 0;
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = static_cast<float>(from[i]);
      check += to[i] * 0;
    }
    return check == 0;
  }

  // Of a row that double has answered.
  static Outcome climbed(Outcome out, bool finite) {
    if (out && !finite) return {.status = Outcome::Status::not_finite};
    out.recomputed = static_cast<bool>(out);
    return out;
  }

  // M or M^-1 of one state, likewise.
  bool round_matrix(const double* from, float* to) const {
    bool finite = true;
    for (std::size_t j = 0; j < nv(); ++j) {
      const std::size_t first = j * nv() + (lower_ ? j : 0);
      finite &= round(nv() * (j + 1) - first, from + first, to + first);
    }
    return finite;
  }

  // out: of what is rounded to `to`; adds: its error for that.
  static Outcome rounded(Outcome out, std::size_t count, const double* from, float* to,
                         double adds = unit_roundoff<float>()) {
    const bool finite = round(count, from, to);
    if (!out) return out;
    if (!finite) return {.status = Outcome::Status::not_finite};
    out.error += adds;
    return out;
  }

  // Of accelerations, whose error for that is known.
  Outcome rounded_motion(const Outcome& out, const double* from, float* a) const {
    double lost = 0, squares = 0;
    for (std::size_t k = 0; k < nv(); ++k) {
      const double rest = from[k] - static_cast<double>(static_cast<float>(from[k]));
      lost += rest * rest;
      squares += from[k] * from[k];
    }
    return rounded(out, nv(), from, a, squares > 0 ? std::sqrt(lost / squares) : 0);
  }

  Model<float> model_;
  LoweredModel<float> lowered_;
  Acceptance<float> acceptance_;
  RowsInLanes<float> rows_;
  AccelerationRows<float, F> accelerations_;
  bool in_lanes_;
  bool lower_;  // of M and M^-1 of one state, the lower triangle alone
  std::unique_ptr<Wide> wide_;
  std::size_t selected_;
  Numbers one_;
  std::vector<double> columns_, X_;
  std::vector<Climb> climbs_;  // of every worker
};

}  // namespace kalmarm
