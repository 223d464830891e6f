#include "kalmarm/gradients.hpp"

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

#include "algorithms/dynamics/threads.hpp"
#include "algorithms/fast/derivatives/gradient_engine.hpp"
#include "algorithms/fast/engine/engine.hpp"

namespace kalmarm {
namespace {

// Rows that a worker takes at once.
constexpr std::ptrdiff_t rows_of_a_worker = 64;

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("gradients: " + what);
}

DynamicsOptions of_factors(DynamicsOptions options) {
  Question& question = options.question;
  if (!question.locked.empty() || !question.dofs.empty())
    refuse("of a question that leaves joints out");
  if (question.at_rest) refuse("of a question that is at rest");
  for (const std::vector<Frame>* frames : {&question.acted_on, &question.loaded})
    for (const Frame& frame : *frames)
      if (frame.link < 0) refuse("a frame on the fixed base, where forces and loads do nothing");
  question.want = {Want::acceleration, Want::solve};
  question.frames.clear();
  question.contacts.clear();
  options.kernels = Kernels::loops;
  return options;
}

CallFrames frames_of(const Question& question) { return {question.acted_on, {}, question.loaded}; }

template <class View>
void check(const char* call, const char* name, const View& rows, std::ptrdiff_t count,
           std::ptrdiff_t width) {
  if (!rows.fits(count, width))
    throw std::invalid_argument(std::string(call) + ": " + name + " has size " + rows.shape() +
                                ", " + detail::shape(count, width) + " is needed");
}

template <class T>
struct Given {
  const char* name;
  RowsView<const T> rows;
  std::ptrdiff_t width;
};
template <class T>
void check_all(const char* call, std::ptrdiff_t count, std::initializer_list<Given<T>> all) {
  for (const auto& [name, rows, width] : all) check(call, name, rows, count, width);
}

// One state as a row.
template <class T>
RowsView<T> row(const VectorView<T>& x) {
  return {x.data(), 1, x.size()};
}
template <class T>
std::optional<RowsView<T>> row(const std::optional<VectorView<T>>& x) {
  if (!x) return {};
  return row(*x);
}
template <class T>
ForceRows<T> row(const StateForces<T>& forces) {
  return {row(forces.on), forces.axes, row(forces.loads)};
}
template <class T>
RowsOfVectorJacobian<T> row(const StateVectorJacobian<T>& out) {
  return {row(out.dq),       row(out.dqd),    row(out.dtau),  row(out.inertias),
          row(out.armature), row(out.forces), row(out.loads), row(out.result)};
}

template <class T>
RowsView<T> part_of(const RowsView<T>& rows, std::ptrdiff_t first, std::ptrdiff_t count,
                    std::ptrdiff_t width) {
  return {rows.data() + first * width, count, width};
}

template <class View>
auto* data_of(const View& rows) {
  return rows ? rows->data() : nullptr;
}

}  // namespace

template <class T>
Gradients<T>::Gradients(const RobotModel& model, const DynamicsOptions& options)
    : nq_(model.nq),
      nv_(model.nv()),
      width_(nq_, nv_, nv_, 0, frames_of(options.question)),
      dynamics_(model, of_factors(options)),
      engine_(make_gradients<T>(model, frames_of(options.question))),
      threads_(std::make_unique<Threads>()) {}

template <class T>
Gradients<T>::~Gradients() = default;
template <class T>
Gradients<T>::Gradients(Gradients&&) noexcept = default;
template <class T>
Gradients<T>& Gradients<T>::operator=(Gradients&&) noexcept = default;

template <class T>
GradientCall<T> Gradients<T>::checked(const char* call, std::ptrdiff_t count, bool moves,
                                      const RowsOfVectorJacobian<T>& out) const {
  const auto size = [&](const char* name, const std::optional<RowsView<T>>& rows,
                        std::ptrdiff_t width) {
    if (rows) check(call, name, *rows, count, width);
    return data_of(rows);
  };
  if (!moves && out.dqd)
    throw std::invalid_argument(std::string(call) + ": dqd: of what does not move");
  return {.moves = moves,
          .by = {size("dq", out.dq, nv_), size("dqd", out.dqd, nv_), size("dtau", out.dtau, nv_),
                 size("inertias", out.inertias, numbers_of_load * nv_),
                 size("armature", out.armature, nv_), size("forces", out.forces, width_.f),
                 size("loads", out.loads, width_.l)}};
}

template <class T>
void Gradients<T>::check_forces(const char* call, std::ptrdiff_t count,
                                const ForceRows<T>& forces) const {
  if (forces.on && forces.axes != Axes::local)
    throw std::invalid_argument(
        std::string(call) + ": forces that do not turn with their frames: Axes::local is needed");
  if (forces.on) check(call, "forces", *forces.on, count, width_.f);
  if (forces.loads) check(call, "loads", *forces.loads, count, width_.l);
}

template <class T>
LoadRows<T> Gradients<T>::part(const LoadRows<T>& loads, std::ptrdiff_t first,
                               std::ptrdiff_t rows) const {
  if (!loads) return {};
  return part_of(*loads, first, rows, width_.l);
}
template <class T>
ForceRows<T> Gradients<T>::part(const ForceRows<T>& forces, std::ptrdiff_t first,
                                std::ptrdiff_t rows) const {
  ForceRows<T> out{.axes = forces.axes, .loads = part(forces.loads, first, rows)};
  if (forces.on) out.on = part_of(*forces.on, first, rows, width_.f);
  return out;
}

template <class T>
void Gradients<T>::run(std::ptrdiff_t count, const GradientCall<T>& call, int threads) {
  if (!engine_) throw std::logic_error("Gradients: was moved from, and answers nothing");
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
    threads_->run(threads, parts, one);
}

// (1), (3). lambda stands where the derivative by tau is asked for.
template <class T>
int Gradients<T>::contract(std::ptrdiff_t count, GradientCall<T> call, T* result, int threads,
                           const Solved& solved) {
  T* const lambda = std::exchange(call.by.qdd, nullptr);
  const std::size_t size = std::min(count, rows_at_once) * nv_;
  if (!result) result_.resize(std::max(result_.size(), size));
  if (!lambda) lambda_.resize(std::max(lambda_.size(), size));
  call.sign = T(-1);
  int failed = 0;
  for (std::ptrdiff_t first = 0; first < count; first += rows_at_once) {
    const std::ptrdiff_t rows = std::min(rows_at_once, count - first), at = first * nv_;
    T* const of_rows = result ? result + at : result_.data();
    T* const weights = lambda ? lambda + at : lambda_.data();
    failed += solved(first, rows, RowsView<T>(of_rows, rows, nv_), RowsView<T>(weights, rows, nv_));
    GradientCall<T> some = call.from(first, width_);
    some.qdd = of_rows;
    some.lambda = weights;
    run(rows, some, threads);
  }
  return failed;
}

// (4)
template <class T>
int Gradients<T>::change(const GradientCall<T>& call, RowsView<const T> q, RowsView<const T> dtau,
                         RowsView<T> dx, std::span<Outcome> outcomes, int threads,
                         const LoadRows<T>& loads, const Moved& moved) {
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  const std::size_t size = std::min(count, rows_at_once) * nv_;
  result_.resize(std::max(result_.size(), size));
  torque_.resize(std::max(torque_.size(), size));
  outcomes_.resize(std::max(outcomes_.size(), outcomes.size()));
  int failed = 0;
  for (std::ptrdiff_t first = 0; first < count; first += rows_at_once) {
    const std::ptrdiff_t rows = std::min(rows_at_once, count - first), at = first * nv_;
    moved(first, rows, RowsView<T>(result_.data(), rows, nv_));
    GradientCall<T> some = call.from(first, width_);
    some.qdd = result_.data();
    some.dtau = torque_.data();
    run(rows, some, threads);
    for (std::ptrdiff_t i = 0; i < rows * nv_; ++i) torque_[i] = dtau.data()[at + i] - torque_[i];
    const std::span<Outcome> of_dx = std::span(outcomes_).first(rows);
    static_cast<void>(  // counted below
        dynamics_.solve(part_of(q, first, rows, nq_), RowsView<const T>(torque_.data(), rows, nv_),
                        part_of(dx, first, rows, nv_), of_dx, threads,
                        {.loads = part(loads, first, rows)}));
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
      Outcome& one = outcomes[first + i];
      one = worse(one, of_dx[i]);
      failed += !one;
    }
  }
  return failed;
}

// --- forward dynamics

template <class T>
int Gradients<T>::forward_dynamics_vjp(RowsView<const T> q, RowsView<const T> qd,
                                       RowsView<const T> tau, RowsView<const T> w,
                                       const RowsOfVectorJacobian<T>& out,
                                       std::span<Outcome> outcomes, int threads,
                                       const ForceRows<T>& forces) {
  constexpr const char* name = "forward_dynamics_vjp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  GradientCall<T> call = checked(name, count, true, out);
  check_all<T>(name, count, {{"q", q, nq_}, {"qd", qd, nv_}, {"tau", tau, nv_}, {"w", w, nv_}});
  if (out.result) check(name, "result", *out.result, count, nv_);
  check_forces(name, count, forces);
  call.q = q.data();
  call.qd = qd.data();
  call.forces = data_of(forces.on);
  call.loads = data_of(forces.loads);
  const auto solved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> a,
                          RowsView<T> lambda) {
    const auto some = [&](const RowsView<const T>& x, int width) {
      return part_of(x, first, rows, width);
    };
    return dynamics_.forward_dynamics_and_solve(some(q, nq_), some(qd, nv_), some(tau, nv_), a,
                                                some(w, nv_), lambda, outcomes.subspan(first, rows),
                                                threads, part(forces, first, rows));
  };
  return contract(count, call, data_of(out.result), threads, std::cref(solved));
}

template <class T>
int Gradients<T>::forward_dynamics_jvp(RowsView<const T> q, RowsView<const T> qd,
                                       RowsView<const T> tau, RowsView<const T> dq,
                                       RowsView<const T> dqd, RowsView<const T> dtau,
                                       RowsView<T> da, std::span<Outcome> outcomes, int threads,
                                       const ForceRows<T>& forces) {
  constexpr const char* name = "forward_dynamics_jvp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  check_all<T>(name, count,
               {{"q", q, nq_},
                {"qd", qd, nv_},
                {"tau", tau, nv_},
                {"dq", dq, nv_},
                {"dqd", dqd, nv_},
                {"dtau", dtau, nv_},
                {"da", da, nv_}});
  check_forces(name, count, forces);
  GradientCall<T> call{.q = q.data(), .qd = qd.data()};
  call.forces = data_of(forces.on);
  call.loads = data_of(forces.loads);
  call.dq = dq.data();
  call.dqd = dqd.data();
  const auto moved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> a) {
    static_cast<void>(dynamics_.forward_dynamics(  // counted with those of da
        part_of(q, first, rows, nq_), part_of(qd, first, rows, nv_), part_of(tau, first, rows, nv_),
        a, outcomes.subspan(first, rows), threads, part(forces, first, rows)));
  };
  return change(call, q, dtau, da, outcomes, threads, forces.loads, std::cref(moved));
}

// --- inverse dynamics

template <class T>
void Gradients<T>::inverse_dynamics_vjp(RowsView<const T> q, RowsView<const T> qd,
                                        RowsView<const T> qdd, RowsView<const T> w,
                                        const RowsOfVectorJacobian<T>& out, int threads,
                                        const ForceRows<T>& forces) {
  constexpr const char* name = "inverse_dynamics_vjp";
  const std::ptrdiff_t count = q.size() / std::max(nq_, 1);
  GradientCall<T> call = checked(name, count, true, out);
  check_all<T>(name, count, {{"q", q, nq_}, {"qd", qd, nv_}, {"qdd", qdd, nv_}, {"w", w, nv_}});
  if (out.result) throw std::invalid_argument(std::string(name) + ": result: is not worked out");
  check_forces(name, count, forces);
  call.q = q.data();
  call.qd = qd.data();
  call.qdd = qdd.data();
  call.lambda = w.data();
  call.forces = data_of(forces.on);
  call.loads = data_of(forces.loads);
  run(count, call, threads);
}

template <class T>
void Gradients<T>::inverse_dynamics_jvp(RowsView<const T> q, RowsView<const T> qd,
                                        RowsView<const T> qdd, RowsView<const T> dq,
                                        RowsView<const T> dqd, RowsView<const T> dqdd,
                                        RowsView<T> dtau, int threads, const ForceRows<T>& forces) {
  constexpr const char* name = "inverse_dynamics_jvp";
  const std::ptrdiff_t count = q.size() / std::max(nq_, 1);
  check_all<T>(name, count,
               {{"q", q, nq_},
                {"qd", qd, nv_},
                {"qdd", qdd, nv_},
                {"dq", dq, nv_},
                {"dqd", dqd, nv_},
                {"dqdd", dqdd, nv_},
                {"dtau", dtau, nv_}});
  check_forces(name, count, forces);
  GradientCall<T> call{.q = q.data(), .qd = qd.data(), .qdd = qdd.data()};
  call.forces = data_of(forces.on);
  call.loads = data_of(forces.loads);
  call.dq = dq.data();
  call.dqd = dqd.data();
  call.dqdd = dqdd.data();
  call.dtau = dtau.data();
  run(count, call, threads);
}

// --- solve

template <class T>
int Gradients<T>::solve_vjp(RowsView<const T> q, RowsView<const T> tau, RowsView<const T> w,
                            const RowsOfVectorJacobian<T>& out, std::span<Outcome> outcomes,
                            int threads, const LoadRows<T>& loads) {
  constexpr const char* name = "solve_vjp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  GradientCall<T> call = checked(name, count, false, out);
  check_all<T>(name, count, {{"q", q, nq_}, {"tau", tau, nv_}, {"w", w, nv_}});
  if (out.result) check(name, "result", *out.result, count, nv_);
  if (loads) check(name, "loads", *loads, count, width_.l);
  call.q = q.data();
  call.loads = data_of(loads);
  outcomes_.resize(std::max(outcomes_.size(), outcomes.size()));
  const auto solved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> x,
                          RowsView<T> lambda) {
    const auto at = part_of(q, first, rows, nq_);
    const ContactRows<T> acting{.loads = part(loads, first, rows)};
    const std::span<Outcome> of_x = outcomes.subspan(first, rows),
                             of_lambda = std::span(outcomes_).first(rows);
    static_cast<void>(  // counted below
        dynamics_.solve(at, part_of(tau, first, rows, nv_), x, of_x, threads, acting));
    static_cast<void>(
        dynamics_.solve(at, part_of(w, first, rows, nv_), lambda, of_lambda, threads, acting));
    int failed = 0;
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
      of_x[i] = worse(of_x[i], of_lambda[i]);
      failed += !of_x[i];
    }
    return failed;
  };
  return contract(count, call, data_of(out.result), threads, std::cref(solved));
}

template <class T>
int Gradients<T>::solve_jvp(RowsView<const T> q, RowsView<const T> tau, RowsView<const T> dq,
                            RowsView<const T> dtau, RowsView<T> dx, std::span<Outcome> outcomes,
                            int threads, const LoadRows<T>& loads) {
  constexpr const char* name = "solve_jvp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  check_all<T>(
      name, count,
      {{"q", q, nq_}, {"tau", tau, nv_}, {"dq", dq, nv_}, {"dtau", dtau, nv_}, {"dx", dx, nv_}});
  if (loads) check(name, "loads", *loads, count, width_.l);
  GradientCall<T> call{.moves = false, .q = q.data()};
  call.loads = data_of(loads);
  call.dq = dq.data();
  const auto moved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> x) {
    static_cast<void>(dynamics_.solve(  // counted with those of dx
        part_of(q, first, rows, nq_), part_of(tau, first, rows, nv_), x,
        outcomes.subspan(first, rows), threads, {.loads = part(loads, first, rows)}));
  };
  return change(call, q, dtau, dx, outcomes, threads, loads, std::cref(moved));
}

// --- one state

template <class T>
Outcome Gradients<T>::forward_dynamics_vjp(VectorView<const T> q, VectorView<const T> qd,
                                           VectorView<const T> tau, VectorView<const T> w,
                                           const StateVectorJacobian<T>& out,
                                           const StateForces<T>& forces) {
  Outcome one;
  static_cast<void>(  // `one` says it, here and below
      forward_dynamics_vjp(row(q), row(qd), row(tau), row(w), row(out), std::span(&one, 1), 1,
                           row(forces)));
  return one;
}

template <class T>
Outcome Gradients<T>::forward_dynamics_jvp(VectorView<const T> q, VectorView<const T> qd,
                                           VectorView<const T> tau, VectorView<const T> dq,
                                           VectorView<const T> dqd, VectorView<const T> dtau,
                                           VectorView<T> da, const StateForces<T>& forces) {
  Outcome one;
  static_cast<void>(forward_dynamics_jvp(row(q), row(qd), row(tau), row(dq), row(dqd), row(dtau),
                                         row(da), std::span(&one, 1), 1, row(forces)));
  return one;
}

template <class T>
void Gradients<T>::inverse_dynamics_vjp(VectorView<const T> q, VectorView<const T> qd,
                                        VectorView<const T> qdd, VectorView<const T> w,
                                        const StateVectorJacobian<T>& out,
                                        const StateForces<T>& forces) {
  inverse_dynamics_vjp(row(q), row(qd), row(qdd), row(w), row(out), 1, row(forces));
}

template <class T>
void Gradients<T>::inverse_dynamics_jvp(VectorView<const T> q, VectorView<const T> qd,
                                        VectorView<const T> qdd, VectorView<const T> dq,
                                        VectorView<const T> dqd, VectorView<const T> dqdd,
                                        VectorView<T> dtau, const StateForces<T>& forces) {
  inverse_dynamics_jvp(row(q), row(qd), row(qdd), row(dq), row(dqd), row(dqdd), row(dtau), 1,
                       row(forces));
}

template <class T>
Outcome Gradients<T>::solve_vjp(VectorView<const T> q, VectorView<const T> tau,
                                VectorView<const T> w, const StateVectorJacobian<T>& out,
                                const StateLoads<T>& loads) {
  Outcome one;
  static_cast<void>(
      solve_vjp(row(q), row(tau), row(w), row(out), std::span(&one, 1), 1, row(loads)));
  return one;
}

template <class T>
Outcome Gradients<T>::solve_jvp(VectorView<const T> q, VectorView<const T> tau,
                                VectorView<const T> dq, VectorView<const T> dtau, VectorView<T> dx,
                                const StateLoads<T>& loads) {
  Outcome one;
  static_cast<void>(
      solve_jvp(row(q), row(tau), row(dq), row(dtau), row(dx), std::span(&one, 1), 1, row(loads)));
  return one;
}

template class Gradients<float>;
template class Gradients<double>;

}  // namespace kalmarm
