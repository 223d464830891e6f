#include "kalmarm/gradients.hpp"

#include <algorithm>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

#include "algorithms/dynamics/gradient_rows.hpp"
#include "kalmarm/kinematics.hpp"

namespace kalmarm {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("gradients: " + what);
}

DynamicsOptions of_factors(DynamicsOptions options) {
  Question& question = options.question;
  if (!question.locked.empty() || !question.dofs.empty())
    refuse("of a question that leaves joints out");
  if (question.at_rest) refuse("of a question that is at rest");
  if (!are_on_links(question))
    refuse("a frame on the fixed base, where forces and loads do nothing");
  question.want = {Want::acceleration, Want::solve};
  question.frames.clear();
  question.contacts.clear();
  options.kernels = Kernels::loops;
  return options;
}

template <class T>
RowsOfVectorJacobian<T> row(const StateVectorJacobian<T>& out) {
  return {row(out.dq),     row(out.dqd),   row(out.dtau),    row(out.inertias), row(out.armature),
          row(out.forces), row(out.loads), row(out.gravity), row(out.result)};
}

Question acted_on_frames(const Question& question) {
  Question out;
  out.acted_on = question.frames;
  out.loaded = question.loaded;
  return out;
}

}  // namespace

// (5) of rows that are worked on at once.
template <class T>
struct OperationalRows {
  static constexpr std::ptrdiff_t rows_at_once = 1024;

  // Of every row a column of forces (k), their torques, and what these accelerate a robot by that neither moves nor weighs
  // anything (nv each).
  struct Response {
    std::vector<T> forces, torques, x;
  };

  Kinematics<T> kinematics;
  GradientRows<T> sweeps;
  std::ptrdiff_t nv, k;
  std::vector<T> Jt;  // of every row nv x k
  Response unit, weighted;
  std::vector<T> still;                                     // nv of every row
  std::vector<T> by_q, by_inertias, by_armature, by_loads;  // of one column

  OperationalRows(const RobotModel& model, const Question& question)
      : kinematics(model, question.frames),
        sweeps(model, acted_on_frames(question)),
        nv(model.nv()),
        k(sweeps.width().f) {}

  void reserve(std::ptrdiff_t rows) {
    const auto grow = [rows](std::vector<T>& to, std::ptrdiff_t numbers) {
      to.resize(std::max<std::size_t>(to.size(), rows * numbers));
    };
    grow(Jt, nv * k);
    for (Response* const of : {&unit, &weighted}) {
      grow(of->forces, k);
      grow(of->torques, nv);
      grow(of->x, nv);
    }
    for (std::vector<T>* const of_dofs : {&still, &by_q, &by_armature}) grow(*of_dofs, nv);
    grow(by_inertias, numbers_of_load * nv);
    grow(by_loads, sweeps.width().l);
  }

  // force(row, i) of every row, and J' of them.
  template <class Force>
  void set(Response& to, std::ptrdiff_t rows, const Force& force) const {
    std::fill_n(to.torques.begin(), rows * nv, T(0));
    for (std::ptrdiff_t row = 0; row < rows; ++row)
      for (std::ptrdiff_t i = 0; i < k; ++i) {
        const T f = to.forces[row * k + i] = force(row, i);
        for (std::ptrdiff_t dof = 0; dof < nv; ++dof)
          to.torques[row * nv + dof] += f * Jt[(row * k + i) * nv + dof];
      }
  }
};

template <class T>
Gradients<T>::Gradients(const RobotModel& model, const DynamicsOptions& options)
    : nq_(model.nq),
      nv_(model.nv()),
      dynamics_(model, of_factors(options)),
      sweeps_(std::make_unique<GradientRows<T>>(model, options.question)) {
  const std::vector<Frame>& frames = options.question.frames;
  if (!frames.empty() && std::ranges::all_of(frames, is_on_link))
    operational_ = std::make_unique<OperationalRows<T>>(model, options.question);
}

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
    if (rows) check_size(call, name, *rows, count, width);
    return data_of(rows);
  };
  const Widths& width = sweeps().width();
  if (!moves && out.dqd)
    throw std::invalid_argument(std::string(call) + ": dqd: of what does not move");
  if (!moves && out.gravity)
    throw std::invalid_argument(std::string(call) + ": gravity: of what does not weigh");
  return {
      .moves = moves,
      .by = {size("dq", out.dq, nv_), size("dqd", out.dqd, nv_), size("dtau", out.dtau, nv_),
             size("inertias", out.inertias, numbers_of_load * nv_),
             size("armature", out.armature, nv_), size("forces", out.forces, width.f),
             size("loads", out.loads, width.l), size("gravity", out.gravity, numbers_of_gravity)}};
}

template <class T>
GradientRows<T>& Gradients<T>::sweeps() const {
  if (!sweeps_) throw std::logic_error("Gradients: was moved from, and answers nothing");
  return *sweeps_;
}

template <class T>
OperationalRows<T>& Gradients<T>::operational() const {
  static_cast<void>(sweeps());
  if (!operational_)
    throw std::logic_error("operational_vjp: the question has no frames, or one on the fixed base");
  return *operational_;
}

// (4)
template <class T>
int Gradients<T>::changed(std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<const T> q,
                          RowsView<const T> dtau, T* dID, RowsView<T> dx,
                          std::span<Outcome> outcomes, int threads, const LoadRows<T>& loads) {
  for (std::ptrdiff_t i = 0; i < rows * nv_; ++i) dID[i] = dtau.data()[first * nv_ + i] - dID[i];
  outcomes_.resize(std::max<std::size_t>(outcomes_.size(), rows));
  const std::span<Outcome> of_dx = std::span(outcomes_).first(rows);
  static_cast<void>(  // counted below
      dynamics_.solve(part_of(q, first, rows, nq_), RowsView<const T>(dID, rows, nv_),
                      part_of(dx, first, rows, nv_), of_dx, threads,
                      {.loads = sweeps().part(loads, first, rows)}));
  int failed = 0;
  for (std::ptrdiff_t i = 0; i < rows; ++i) {
    Outcome& one = outcomes[first + i];
    one = worse(one, of_dx[i]);
    failed += !one;
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
  check_sizes<T>(name, count, {{"q", q, nq_}, {"qd", qd, nv_}, {"tau", tau, nv_}, {"w", w, nv_}});
  if (out.result) check_size(name, "result", *out.result, count, nv_);
  sweeps().check(name, count, forces);
  call.q = q.data();
  call.qd = qd.data();
  act(call, forces);
  const auto solved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> a,
                          RowsView<T> lambda) {
    const auto some = [&](const RowsView<const T>& x, int width) {
      return part_of(x, first, rows, width);
    };
    return dynamics_.forward_dynamics_and_solve(some(q, nq_), some(qd, nv_), some(tau, nv_), a,
                                                some(w, nv_), lambda, outcomes.subspan(first, rows),
                                                threads, sweeps().part(forces, first, rows));
  };
  T* const lambda = std::exchange(call.by.qdd, nullptr);
  return sweeps().contract(count, call, data_of(out.result), lambda, threads, solved);
}

template <class T>
int Gradients<T>::forward_dynamics_jvp(RowsView<const T> q, RowsView<const T> qd,
                                       RowsView<const T> tau, RowsView<const T> dq,
                                       RowsView<const T> dqd, RowsView<const T> dtau,
                                       RowsView<T> da, std::span<Outcome> outcomes, int threads,
                                       const ForceRows<T>& forces) {
  constexpr const char* name = "forward_dynamics_jvp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  check_sizes<T>(name, count,
                 {{"q", q, nq_},
                  {"qd", qd, nv_},
                  {"tau", tau, nv_},
                  {"dq", dq, nv_},
                  {"dqd", dqd, nv_},
                  {"dtau", dtau, nv_},
                  {"da", da, nv_}});
  sweeps().check(name, count, forces);
  GradientCall<T> call{.q = q.data(), .qd = qd.data()};
  act(call, forces);
  call.dq = dq.data();
  call.dqd = dqd.data();
  const auto moved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> a) {
    static_cast<void>(dynamics_.forward_dynamics(  // counted with those of da
        part_of(q, first, rows, nq_), part_of(qd, first, rows, nv_), part_of(tau, first, rows, nv_),
        a, outcomes.subspan(first, rows), threads, sweeps().part(forces, first, rows)));
  };
  int failed = 0;
  sweeps().tangents(count, call, threads, moved,
                    [&](std::ptrdiff_t first, std::ptrdiff_t rows, const T*, RowsView<T> dID) {
                      failed += changed(first, rows, q, dtau, dID.data(), da, outcomes, threads,
                                        forces.loads);
                    });
  return failed;
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
  check_sizes<T>(name, count, {{"q", q, nq_}, {"qd", qd, nv_}, {"qdd", qdd, nv_}, {"w", w, nv_}});
  if (out.result) throw std::invalid_argument(std::string(name) + ": result: is not worked out");
  sweeps().check(name, count, forces);
  call.q = q.data();
  call.qd = qd.data();
  call.qdd = qdd.data();
  call.lambda = w.data();
  act(call, forces);
  sweeps().run(count, call, threads);
}

template <class T>
void Gradients<T>::inverse_dynamics_jvp(RowsView<const T> q, RowsView<const T> qd,
                                        RowsView<const T> qdd, RowsView<const T> dq,
                                        RowsView<const T> dqd, RowsView<const T> dqdd,
                                        RowsView<T> dtau, int threads, const ForceRows<T>& forces) {
  constexpr const char* name = "inverse_dynamics_jvp";
  const std::ptrdiff_t count = q.size() / std::max(nq_, 1);
  check_sizes<T>(name, count,
                 {{"q", q, nq_},
                  {"qd", qd, nv_},
                  {"qdd", qdd, nv_},
                  {"dq", dq, nv_},
                  {"dqd", dqd, nv_},
                  {"dqdd", dqdd, nv_},
                  {"dtau", dtau, nv_}});
  sweeps().check(name, count, forces);
  GradientCall<T> call{.q = q.data(), .qd = qd.data(), .qdd = qdd.data()};
  act(call, forces);
  call.dq = dq.data();
  call.dqd = dqd.data();
  call.dqdd = dqdd.data();
  call.dtau = dtau.data();
  sweeps().run(count, call, threads);
}

// --- solve

template <class T>
int Gradients<T>::solve_vjp(RowsView<const T> q, RowsView<const T> tau, RowsView<const T> w,
                            const RowsOfVectorJacobian<T>& out, std::span<Outcome> outcomes,
                            int threads, const LoadRows<T>& loads) {
  constexpr const char* name = "solve_vjp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  GradientCall<T> call = checked(name, count, false, out);
  check_sizes<T>(name, count, {{"q", q, nq_}, {"tau", tau, nv_}, {"w", w, nv_}});
  if (out.result) check_size(name, "result", *out.result, count, nv_);
  sweeps().check(name, count, loads);
  call.q = q.data();
  call.loads = data_of(loads);
  outcomes_.resize(std::max(outcomes_.size(), outcomes.size()));
  const auto solved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> x,
                          RowsView<T> lambda) {
    const auto at = part_of(q, first, rows, nq_);
    const ContactRows<T> acting{.loads = sweeps().part(loads, first, rows)};
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
  T* const lambda = std::exchange(call.by.qdd, nullptr);
  return sweeps().contract(count, call, data_of(out.result), lambda, threads, solved);
}

template <class T>
int Gradients<T>::solve_jvp(RowsView<const T> q, RowsView<const T> tau, RowsView<const T> dq,
                            RowsView<const T> dtau, RowsView<T> dx, std::span<Outcome> outcomes,
                            int threads, const LoadRows<T>& loads) {
  constexpr const char* name = "solve_jvp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  check_sizes<T>(
      name, count,
      {{"q", q, nq_}, {"tau", tau, nv_}, {"dq", dq, nv_}, {"dtau", dtau, nv_}, {"dx", dx, nv_}});
  sweeps().check(name, count, loads);
  GradientCall<T> call{.moves = false, .q = q.data()};
  call.loads = data_of(loads);
  call.dq = dq.data();
  const auto moved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> x) {
    static_cast<void>(dynamics_.solve(  // counted with those of dx
        part_of(q, first, rows, nq_), part_of(tau, first, rows, nv_), x,
        outcomes.subspan(first, rows), threads, {.loads = sweeps().part(loads, first, rows)}));
  };
  int failed = 0;
  sweeps().tangents(count, call, threads, moved,
                    [&](std::ptrdiff_t first, std::ptrdiff_t rows, const T*, RowsView<T> dID) {
                      failed +=
                          changed(first, rows, q, dtau, dID.data(), dx, outcomes, threads, loads);
                    });
  return failed;
}

// --- operational

template <class T>
int Gradients<T>::operational_vjp(RowsView<const T> q, RowsView<const T> W,
                                  const RowsOfVectorJacobian<T>& out, std::span<Outcome> outcomes,
                                  int threads, const LoadRows<T>& loads) {
  constexpr const char* name = "operational_vjp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  static_cast<void>(checked(name, count, false, out));
  if (out.dtau || out.forces || out.result)
    throw std::invalid_argument(std::string(name) + ": of dq, inertias, armature and loads alone");
  OperationalRows<T>& of = operational();
  check_sizes<T>(name, count, {{"q", q, nq_}, {"W", W, of.k * of.k}});
  sweeps().check(name, count, loads);
  of.reserve(std::min(count, of.rows_at_once));
  outcomes_.resize(std::max<std::size_t>(outcomes_.size(), std::min(count, of.rows_at_once)));
  const std::ptrdiff_t l = sweeps().width().l;
  struct Sum {
    T* to;
    const T* from;
    std::ptrdiff_t width;
  };
  int failed = 0;
  for (std::ptrdiff_t first = 0; first < count; first += of.rows_at_once) {
    const std::ptrdiff_t rows = std::min(of.rows_at_once, count - first);
    const std::span<Outcome> of_rows = outcomes.subspan(first, rows);
    const RowsView<const T> at = part_of(q, first, rows, nq_);
    const LoadRows<T> loaded = sweeps().part(loads, first, rows);
    const Sum of_q{data_of(out.dq), of.by_q.data(), nv_};
    const Sum of_column[] = {of_q,
                             {data_of(out.inertias), of.by_inertias.data(), numbers_of_load * nv_},
                             {data_of(out.armature), of.by_armature.data(), nv_},
                             {data_of(out.loads), of.by_loads.data(), l}};
    for (const Sum& sum : of_column)
      if (sum.to) std::fill_n(sum.to + first * sum.width, rows * sum.width, T(0));
    const auto add = [&](const Sum& sum) {
      if (!sum.to) return;
      T* const to = sum.to + first * sum.width;
      for (std::ptrdiff_t i = 0; i < rows * sum.width; ++i) to[i] += sum.from[i];
    };
    std::fill(of_rows.begin(), of_rows.end(), Outcome{.rung = Outcome::Rung::float_lanes});
    const auto solve = [&](typename OperationalRows<T>::Response& response) {
      const std::span<Outcome> of_x = std::span(outcomes_).first(rows);
      static_cast<void>(  // counted below
          dynamics_.solve(at, RowsView<const T>(response.torques.data(), rows, nv_),
                          RowsView<T>(response.x.data(), rows, nv_), of_x, threads,
                          {.loads = loaded}));
      for (std::ptrdiff_t i = 0; i < rows; ++i) of_rows[i] = worse(of_rows[i], of_x[i]);
    };
    const T* const weights = W.data() + first * of.k * of.k;
    of.kinematics.compute_rows(
        at, {.axes = Axes::local, .jacobians = RowsView<T>(of.Jt.data(), rows, nv_ * of.k)},
        threads);
    for (std::ptrdiff_t j = 0; j < of.k; ++j) {
      of.set(of.unit, rows, [j](std::ptrdiff_t, std::ptrdiff_t i) { return T(i == j); });
      of.set(of.weighted, rows, [&](std::ptrdiff_t row, std::ptrdiff_t i) {
        return weights[(row * of.k + j) * of.k + i];
      });
      solve(of.unit);
      solve(of.weighted);
      GradientCall<T> call{.moves = false, .q = at.data()};
      call.loads = data_of(loaded);
      call.sign = T(-1);
      call.qdd = of.unit.x.data();
      call.forces = of.unit.forces.data();
      call.lambda = of.weighted.x.data();
      call.by = {.q = of.by_q.data(),
                 .inertias = out.inertias ? of.by_inertias.data() : nullptr,
                 .armature = out.armature ? of.by_armature.data() : nullptr,
                 .loads = out.loads ? of.by_loads.data() : nullptr};
      of.sweeps.run(rows, call, threads);
      for (const Sum& sum : of_column) add(sum);
      call.qdd = of.still.data();
      call.forces = of.weighted.forces.data();
      call.lambda = of.unit.x.data();
      call.by = {.q = of.by_q.data()};
      of.sweeps.run(rows, call, threads);
      add(of_q);
    }
    for (const Outcome& one : of_rows) failed += !one;
  }
  return failed;
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

template <class T>
Outcome Gradients<T>::operational_vjp(VectorView<const T> q, MatrixView<const T> W,
                                      const StateVectorJacobian<T>& out,
                                      const StateLoads<T>& loads) {
  Outcome one;
  const std::ptrdiff_t k = operational().k;
  if (!W.fits(k, k) || W.is_row_major())
    throw std::invalid_argument("operational_vjp: W has size " + W.shape() + ", " +
                                detail::shape(k, k) + ", column-major, is needed");
  static_cast<void>(operational_vjp(row(q), RowsView<const T>(W.data(), 1, k * k), row(out),
                                    std::span(&one, 1), 1, row(loads)));
  return one;
}

template class Gradients<float>;
template class Gradients<double>;

}  // namespace kalmarm
