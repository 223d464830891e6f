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
#include <memory>
#include <vector>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/rows_in_lanes.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/spatial/flush_subnormals.hpp"

namespace kalmarm {

// F: of the lanes' accelerations.
template <class F>
class NarrowEngine final : public Engine<float> {
 public:
  template <class MakeWide>
  NarrowEngine(const RobotModel& robot, const EngineOptions& options, const MakeWide& make_wide)
      : model_(model_of(robot).template cast<float>()),
        lowered_(model_, options.zeros, accepted_error(options.tolerance), options.frames),
        acceptance_(robot, lowered_, options.tolerance),
        lanes_(lowered_, acceptance_, options.selection, options.wants(Want::solve)),
        in_lanes_(options.tolerance >= least_tolerance_of_float &&
                  options.kernel != Kernel::translational),
        width_(lowered_.widths(options.selection.size())),
        lower_(options.triangles == Triangles::lower),
        wide_(make_wide(robot, in_double(options))),
        columns_(width_.nv * most_columns),
        X_(columns_) {
    for (const Want want : options.want) one_.reserve(want, 1, width_);
    if (options.selection.size() > 0) one_.reserve(Want::operational, 1, width_);
    one_.reserve(Want::diagonal, 1, width_);  // of `factor`: q alone
  }

  bool answers_in_part() const override { return wide_->answers_in_part(); }

  // --- one state, in double

  Outcome answer(const Call<float>& call) override {
    const int rows[] = {0};
    Call<double> wide = one_.gather(call, rows, 1, width_);
    if (call.B) with_columns(call, rows, 1, columns_, X_, wide);
    return rounded(wide_->answer(wide), wide, call, lower_);
  }

  Outcome factor(const Call<float>& call) override {
    const int rows[] = {0};
    return wide_->factor(one_.gather(call, rows, 1, width_));
  }

  Outcome solve(int columns, const float* taus, float* X) override {
    Outcome out;
    for (int first = 0; first < columns; first += most_columns) {
      const int m = std::min(most_columns, columns - first);
      const std::ptrdiff_t at = first * width_.n, size = width_.n * m;
      std::copy_n(taus + at, size, columns_.data());
      const Outcome of_some = wide_->solve(m, columns_.data(), X_.data());
      const Outcome next = rounded(of_some, size, X_.data(), X + at);
      out = first > 0 ? worse(out, next) : next;
    }
    return out;
  }

  // --- rows, in lanes of float, and what these leave over in lanes of double

  void reserve_workers(Want want, int count) override {
    wide_->reserve_workers(want, count);
    if (takes_lanes(want)) lanes_.reserve(want, count);
    workers_.resize(std::max<std::size_t>(workers_.size(), count));
    for (Worker& worker : workers_) worker.reserve(want, rows_at_once, width_);
  }

  void answer_rows(int worker, int count, const Call<float>& call, Outcome* outcomes) override {
    Worker& w = workers_[worker];
    w.left_over.assign(count, 1);
    if (takes_lanes(call.want)) lanes_.answer(worker, count, call, outcomes, w.left_over.data());
    for_each_chosen(count, w.left_over.data(), rows_at_once, w.chosen,
                    [&] { climb(worker, call, outcomes); });
  }

 private:
  static constexpr int most_columns = FactorSolver<double>::lanes;
  // Of rows that climb: some blocks of lanes.
  static constexpr int rows_at_once = 4 * RowBlock<double>::lanes;

  // Numbers of calls in double.
  struct Numbers {
    std::vector<double> in, out;

    void reserve(Want want, int rows, const Widths& width) {
      const std::ptrdiff_t of_derivatives = want == Want::derivatives ? 3 * width.n * width.n : 0;
      grow(in, rows * (width.nq + 3 * width.nv + width.f + width.c + width.l + numbers_of_gravity));
      grow(out, rows * (width.out(want) + of_derivatives));
    }

    // The call of chosen rows, with place for what it wants, but for columns.
    Call<double> gather(const Call<float>& call, const int* rows, int count, const Widths& width) {
      Call<double> wide{.want = call.want};
      double* next = in.data();
      const auto widen = [&](const float* from, std::ptrdiff_t numbers) -> const double* {
        if (!from) return nullptr;
        const double* const first = next;
        for (int i = 0; i < count; ++i) next = std::copy_n(from + rows[i] * numbers, numbers, next);
        return first;
      };
      wide.q = widen(call.q, width.nq);
      wide.qd = widen(call.qd, width.nv);
      wide.tau = widen(call.tau, width.tau(call.want));
      wide.forces = widen(call.forces, width.f);
      wide.contacts = widen(call.contacts, width.c);
      wide.loads = widen(call.loads, width.l);
      wide.gravity = widen(call.gravity, numbers_of_gravity);
      wide.axes = call.axes;
      wide.r = widen(call.r, width.nv);
      wide.out = out.data();
      double* X = out.data() + count * width.out(call.want);
      for (std::size_t i = 0; i < wide.derivatives.size(); ++i) {
        if (!call.derivatives[i]) continue;
        wide.derivatives[i] = X;
        X += count * width.n * width.n;
      }
      return wide;
    }
  };
  struct Worker : Numbers {
    std::vector<char> left_over;  // of all rows
    std::vector<int> chosen;      // of these, those that are gathered
    std::vector<Outcome> outcomes;
    std::vector<double> B, X;  // of columns, from the first call with them on

    void reserve(Want want, int rows, const Widths& width) {
      Numbers::reserve(want, rows, width);
      chosen.reserve(rows);
      outcomes.resize(rows);
    }
  };

  static void grow(std::vector<double>& x, std::ptrdiff_t size) {
    x.resize(std::max<std::size_t>(x.size(), size));
  }

  // Double gives its own default at no price.
  static EngineOptions in_double(EngineOptions options) {
    options.tolerance = std::min(options.tolerance, default_tolerance<double>);
    return options;
  }

  bool takes_lanes(Want want) const {
    return in_lanes_ || want == Want::inverse_dynamics || want == Want::mass;
  }

  // Of so many rows of the call.
  void with_columns(const Call<float>& call, const int* rows, int count, std::vector<double>& B,
                    std::vector<double>& X, Call<double>& wide) const {
    const std::ptrdiff_t size = width_.n * call.m;
    const int given = call.B_of_rows ? count : 1;
    grow(B, given * size);
    grow(X, count * size);
    for (int i = 0; i < given; ++i)
      std::copy_n(call.B + (call.B_of_rows ? rows[i] * size : 0), size, B.data() + i * size);
    wide.B_of_rows = call.B_of_rows;
    wide.m = call.m;
    wide.B = B.data();
    wide.X = X.data();
  }

  // The rows that are chosen.
  void climb(int worker, const Call<float>& call, Outcome* outcomes) {
    Worker& w = workers_[worker];
    const int count = static_cast<int>(w.chosen.size());
    Call<double> wide = w.gather(call, w.chosen.data(), count, width_);
    if (call.B) with_columns(call, w.chosen.data(), count, w.B, w.X, wide);
    wide_->answer_rows(worker, count, wide, w.outcomes.data());
    for (int i = 0; i < count; ++i)
      outcomes[w.chosen[i]] =
          rounded(w.outcomes[i], wide.from(i, width_), call.from(w.chosen[i], width_), false);
  }

  // What double has answered to one state, in float. lower: of a matrix, the lower triangle alone.
  Outcome rounded(Outcome out, const Call<double>& from, const Call<float>& to, bool lower) const {
    const std::ptrdiff_t n = width_.n;
    switch (to.want) {
      case Want::acceleration:
        out = rounded_motion(out, from.out, to.out);
        return to.X ? rounded(out, n * to.m, from.X, to.X, 0) : out;
      case Want::mass:
      case Want::inverse: {
        const FlushSubnormals flush;
        if (!lower) return rounded(out, n * n, from.out, to.out);
        for (std::ptrdiff_t j = 0; j < n; ++j) {
          const std::ptrdiff_t diagonal = j * (n + 1);
          out = rounded(out, n - j, from.out + diagonal, to.out + diagonal,
                        j == 0 ? unit_roundoff<float>() : 0);
        }
        return out;
      }
      case Want::derivatives:
        for (std::size_t i = 0; i < to.derivatives.size(); ++i)
          if (to.derivatives[i]) out = rounded(out, n * n, from.derivatives[i], to.derivatives[i]);
        return rounded(out, n, from.out, to.out);
      default:
        return rounded(out, width_.out(to.want), from.out, to.out);
    }
  }

  // out: of what is rounded to `to`; adds: its error for that.
  static Outcome rounded(Outcome out, std::ptrdiff_t count, const double* from, float* to,
                         double adds = unit_roundoff<float>()) {
    float check = 0;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      to[i] = static_cast<float>(from[i]);
      check += to[i] * 0;
    }
    if (!out) return out;
    if (check != 0) return {.status = Outcome::Status::not_finite};
    out.error += adds;
    return out;
  }

  // Of accelerations, whose error for that is known.
  Outcome rounded_motion(const Outcome& out, const double* from, float* a) const {
    double lost = 0, squares = 0;
    for (std::ptrdiff_t k = 0; k < width_.nv; ++k) {
      const double rest = from[k] - static_cast<double>(static_cast<float>(from[k]));
      lost += rest * rest;
      squares += from[k] * from[k];
    }
    return rounded(out, width_.nv, from, a, squares > 0 ? std::sqrt(lost / squares) : 0);
  }

  Model<float> model_;
  LoweredModel<float> lowered_;
  Acceptance<float> acceptance_;
  RowsInLanes<float, F> lanes_;
  bool in_lanes_;
  Widths width_;
  bool lower_;  // of M and M^-1 of one state, the lower triangle alone
  std::unique_ptr<Engine<double>> wide_;
  Numbers one_;
  std::vector<double> columns_, X_;
  std::vector<Worker> workers_;
};

}  // namespace kalmarm
