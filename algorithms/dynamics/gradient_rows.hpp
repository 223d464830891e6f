// Derivatives of inverse dynamics of rows of states, on several cores, some rows after others: their accelerations, and the
// weights or directions that they are derived with, come from calls of the same rows that stand around them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/rows.hpp"
#include "algorithms/dynamics/threads.hpp"
#include "algorithms/fast/derivatives/gradient_engine.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

// Where forces and loads can do something.
inline bool is_on_link(const Frame& frame) { return frame.link >= 0; }
inline bool are_on_links(const Question& question) {
  return std::ranges::all_of(question.acted_on, is_on_link) &&
         std::ranges::all_of(question.loaded, is_on_link);
}

template <class T>
void act(GradientCall<T>& call, const ForceRows<T>& forces) {
  call.forces = data_of(forces.on);
  call.loads = data_of(forces.loads);
  call.gravity = data_of(forces.gravity);
}

template <class T>
class GradientRows {
 public:
  // Of the question the frames that are acted on and loaded count.
  GradientRows(const RobotModel& model, const Question& question)
      : nv_(model.nv()),
        width_(model.nq, nv_, nv_, 0, frames_of(question)),
        engine_(make_gradients<T>(model, frames_of(question))) {}

  const Widths& width() const { return width_; }

  void check(const char* call, std::ptrdiff_t count, const LoadRows<T>& loads) const {
    if (loads) check_size(call, "loads", *loads, count, width_.l);
  }
  void check(const char* call, std::ptrdiff_t count, const ForceRows<T>& forces) const {
    if (forces.on && forces.axes != Axes::local)
      throw std::invalid_argument(
          std::string(call) + ": forces that do not turn with their frames: Axes::local is needed");
    if (forces.on) check_size(call, "forces", *forces.on, count, width_.f);
    check(call, count, forces.loads);
    if (forces.gravity) check_size(call, "gravity", *forces.gravity, count, numbers_of_gravity);
  }

  LoadRows<T> part(const LoadRows<T>& loads, std::ptrdiff_t first, std::ptrdiff_t rows) const {
    return part_of(loads, first, rows, width_.l);
  }
  ForceRows<T> part(const ForceRows<T>& forces, std::ptrdiff_t first, std::ptrdiff_t rows) const {
    return part_of(forces, first, rows, width_.f, width_.l);
  }

  void run(std::ptrdiff_t count, const GradientCall<T>& call, int threads) {
    if (count == 1) return engine_->answer(call);
    threads = std::max(threads, 1);
    engine_->reserve_workers(threads);
    const auto parts = static_cast<int>((count + rows_of_a_worker - 1) / rows_of_a_worker);
    const auto one = [&](int worker, int i) {
      const std::ptrdiff_t first = i * rows_of_a_worker;
      engine_->answer_rows(worker, static_cast<int>(std::min(rows_of_a_worker, count - first)),
                           call.from(first, width_));
    };
    if (threads == 1)
      for (int i = 0; i < parts; ++i) one(0, i);
    else
      threads_.run(threads, parts, one);
  }

  // Adjoints of -lambda'ID. solved(first, rows, qdd, lambda) fills accelerations and lambda of so many rows, in `qdd` and
  // `lambda` (count x nv) where they are given, and says how many failed, all of whom are returned.
  template <class Solved>
  int contract(std::ptrdiff_t count, const GradientCall<T>& call, T* qdd, T* lambda, int threads,
               const Solved& solved) {
    return contract(count, call, qdd, lambda, threads, solved,
                    [](std::ptrdiff_t, std::ptrdiff_t, const T*, const T*) {});
  }
  // added(first, rows, qdd, lambda) adds to what has come out.
  template <class Solved, class Added>
  int contract(std::ptrdiff_t count, GradientCall<T> call, T* qdd, T* lambda, int threads,
               const Solved& solved, const Added& added) {
    call.sign = T(-1);
    int failed = 0;
    in_parts(count, [&](std::ptrdiff_t first, std::ptrdiff_t rows) {
      T* const of_rows = qdd ? qdd + first * nv_ : kept(qdd_, rows);
      T* const weights = lambda ? lambda + first * nv_ : kept(lambda_, rows);
      failed +=
          solved(first, rows, RowsView<T>(of_rows, rows, nv_), RowsView<T>(weights, rows, nv_));
      GradientCall<T> some = call.from(first, width_);
      some.qdd = of_rows;
      some.lambda = weights;
      run(rows, some, threads);
      added(first, rows, of_rows, weights);
    });
    return failed;
  }

  // dID along the directions of the call. moved(first, rows, qdd) fills accelerations; used(first, rows, qdd, dID) takes what
  // has come out, and may write to dID.
  template <class Moved, class Used>
  void tangents(std::ptrdiff_t count, const GradientCall<T>& call, int threads, const Moved& moved,
                const Used& used) {
    in_parts(count, [&](std::ptrdiff_t first, std::ptrdiff_t rows) {
      T* const qdd = kept(qdd_, rows);
      moved(first, rows, RowsView<T>(qdd, rows, nv_));
      GradientCall<T> some = call.from(first, width_);
      some.qdd = qdd;
      some.dtau = kept(torque_, rows);
      run(rows, some, threads);
      used(first, rows, qdd, RowsView<T>(some.dtau, rows, nv_));
    });
  }

 private:
  static constexpr std::ptrdiff_t rows_at_once = 1024;    // whose numbers are kept
  static constexpr std::ptrdiff_t rows_of_a_worker = 64;  // that it takes at once

  static CallFrames frames_of(const Question& question) {
    return {question.acted_on, {}, question.loaded};
  }

  template <class F>
  static void in_parts(std::ptrdiff_t count, const F& f) {
    for (std::ptrdiff_t first = 0; first < count; first += rows_at_once)
      f(first, std::min(rows_at_once, count - first));
  }

  T* kept(std::vector<T>& numbers, std::ptrdiff_t rows) const {
    numbers.resize(std::max<std::size_t>(numbers.size(), rows * nv_));
    return numbers.data();
  }

  std::ptrdiff_t nv_;
  Widths width_;
  std::unique_ptr<GradientEngine<T>> engine_;
  Threads threads_;
  std::vector<T> qdd_, lambda_, torque_;
};

}  // namespace kalmarm
