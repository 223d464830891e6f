// bench_gradients: time of products of Jacobians with vectors, of one state and of 1024 in one call, beside that of the
// calls that they derive.
//
// Names are task/variant/scene/precision; tasks are acceleration, torque (inverse dynamics), step (an implicit one of 2 ms,
// each state with gains of its own) and operational (J M^-1 J' of the last link), of one state and _batch. The variant is
// the call itself, `result`, or `vjp`, `vjp_inertias` (of all bodies too) or `jvp`, which operational has not. Those of
// accelerations are verified before they are timed, against float64's matrices of derivatives with the bounds of case.hpp.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/gradients.hpp"
#include "kalmarm/step_gradients.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd, tau (or qdd) and the weights, or the direction, to the products: by q, qd and "
    "tau. "
    "Memory is taken before. One state: each call takes the next of a pool.";

constexpr double h = 0.002;  // of a step [s]

enum class Task { acceleration, torque, step, operational };

const char* name_of(Task task) {
  switch (task) {
    case Task::acceleration:
      return "acceleration";
    case Task::torque:
      return "torque";
    case Task::step:
      return "step";
    case Task::operational:
      return "operational";
  }
  return "?";
}

enum class Of { result, vjp, vjp_inertias, jvp };

const char* name_of(Of what) {
  switch (what) {
    case Of::result:
      return "result";
    case Of::vjp:
      return "vjp";
    case Of::vjp_inertias:
      return "vjp_inertias";
    case Of::jvp:
      return "jvp";
  }
  return "?";
}

// Of so many rows of states, with what a call fills.
template <class T>
struct Run {
  Dynamics<T> dynamics;
  Gradients<T> gradients;
  ImplicitStep<T> step;
  StepGradients<T> of_step;
  Pool<T> pool;
  int nq, nv, count;
  std::vector<T> w, of_matrix, X, gains, dq, dqd, dtau, inertias, by_gains[3];
  std::vector<Outcome> outcomes;

  Run(const Case& c, int states)
      : dynamics(
            plain(c.scene.model),
            {.question = {.want = {Want::acceleration, Want::inverse_dynamics, Want::operational},
                          .frames = {{c.scene.model.nv() - 1}}}}),
        gradients(plain(c.scene.model), {.question = {.frames = {{c.scene.model.nv() - 1}}}}),
        step(plain(c.scene.model), h, {}),
        of_step(plain(c.scene.model), h, {}),
        pool(c.states),
        nq(c.scene.model.nq()),
        nv(c.scene.model.nv()),
        count(states),
        X(std::size_t(36) * states),
        dq(std::size_t(states) * nv, std::numeric_limits<T>::quiet_NaN()),
        dqd(dq),
        dtau(dq),
        inertias(10 * dq.size()),
        outcomes(states) {
    const std::vector<LinkParameters> links = plain(c.scene.model).links;
    for (int i = 0; i < batch_size * nv; ++i) {
      w.push_back(static_cast<T>(i % 7 - 3) / T(4));
      gains.push_back(takes_spring(links[i % nv]) ? static_cast<T>(i % 5) : T(0));
    }
    for (std::vector<T>& x : by_gains) x = dq;
    for (int i = 0; i < batch_size * 36; ++i) of_matrix.push_back(static_cast<T>(i % 11 - 5));
  }

  // Of the rows from state i on.
  int call(Task task, Of what, int i) {
    const auto rows = [&](const std::vector<T>& x, int width) {
      return RowsView<const T>(x.data() + std::size_t(i) * width, count, width);
    };
    const auto q = rows(pool.q_rows, nq), qd = rows(pool.qd_rows, nv),
               tau = rows(pool.tau_rows, nv), v = rows(w, nv);
    const RowsView<T> first(dq.data(), count, nv);
    RowsOfVectorJacobian<T> out{.dq = first,
                                .dqd = RowsView<T>(dqd.data(), count, nv),
                                .dtau = RowsView<T>(dtau.data(), count, nv)};
    if (what == Of::vjp_inertias) out.inertias = RowsView<T>(inertias.data(), count, 10 * nv);
    const bool inverse = task == Task::torque;
    if (task == Task::step) {
      const auto x = rows(gains, nv);
      const GainRows<T> own{x, x, x};
      if (what == Of::result) return step.acceleration(q, qd, tau, own, first, outcomes);
      if (what == Of::jvp)
        return of_step.acceleration_jvp(q, qd, tau, v, v, v, first, outcomes, 1, own, {v, v, v});
      const auto by = [&](int which) { return RowsView<T>(by_gains[which].data(), count, nv); };
      return of_step.acceleration_vjp(q, qd, tau, v,
                                      {.dq = out.dq,
                                       .dv = out.dqd,
                                       .dtau = out.dtau,
                                       .damping = by(0),
                                       .stiffness = by(1),
                                       .reference = by(2),
                                       .inertias = out.inertias},
                                      outcomes, 1, own);
    }
    if (task == Task::operational) {
      if (what == Of::result)
        return dynamics.operational(q, RowsView<T>(X.data(), count, 36), outcomes);
      return gradients.operational_vjp(q, rows(of_matrix, 36),
                                       {.dq = out.dq, .inertias = out.inertias}, outcomes);
    }
    switch (what) {
      case Of::result:
        if (!inverse) return dynamics.forward_dynamics(q, qd, tau, first, outcomes);
        dynamics.inverse_dynamics(q, qd, tau, first, 1);
        return 0;
      case Of::jvp:
        if (!inverse) return gradients.forward_dynamics_jvp(q, qd, tau, v, v, v, first, outcomes);
        gradients.inverse_dynamics_jvp(q, qd, tau, v, v, v, first, 1);
        return 0;
      default:
        if (!inverse) return gradients.forward_dynamics_vjp(q, qd, tau, v, out, outcomes);
        gradients.inverse_dynamics_vjp(q, qd, tau, v, out, 1);
        return 0;
    }
  }

  // "" where row i of a call from state 0 on is right.
  std::string judge(const Case& c, Of what, int i) {
    Dynamics<double> exact(plain(c.scene.model), {.question = {.want = {Want::derivatives}}});
    MatrixX<double> by_q(nv, nv), by_qd(nv, nv), by_tau(nv, nv);
    VectorX<double> a(nv);
    const State& state = c.states[i];
    if (const Outcome outcome = exact.derivatives(state.q, state.qd, state.tau,
                                                  {.dq = by_q, .dqd = by_qd, .dtau = by_tau}, a);
        !outcome)
      return describe(c.scene, outcome);
    const auto row = [&](const std::vector<T>& x) -> VectorX<T> {
      return Eigen::Map<const VectorX<T>>(&x[std::size_t(i) * nv], nv);
    };
    const VectorX<double> v = row(w).template cast<double>();
    if (what == Of::result) return c.judge(i, row(dq));
    if (what == Of::jvp)
      return c.compare<T>((by_q * v + by_qd * v + by_tau * v).eval(), row(dq), c.condition[i]);
    std::string flaw = c.compare<T>((by_q.transpose() * v).eval(), row(dq), c.condition[i]);
    if (flaw.empty()) flaw = c.compare<T>((by_qd.transpose() * v).eval(), row(dqd), c.condition[i]);
    if (flaw.empty()) flaw = c.compare<T>((by_tau * v).eval(), row(dtau), c.condition[i]);
    return flaw;
  }
};

template <class T>
void add(std::shared_ptr<const Case> c, Task task, Of what, int states) {
  const std::string name = std::string(name_of(task)) + (states > 1 ? "_batch" : "");
  benchmark::RegisterBenchmark(
      kalmarm::name_of<T>(name, name_of(what), *c).c_str(),
      [=](benchmark::State& run) {
        Run<T> calls(*c, states);
        std::string flaw = c->flaw;
        if (const int failed = calls.call(task, what, 0); failed > 0)
          flaw = std::to_string(failed) + " states failed";
        const bool is_judged = task == Task::acceleration;
        for (int i = 0; is_judged && i < std::min(c->verified(), states) && flaw.empty(); ++i)
          flaw = calls.judge(*c, what, i);
        if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
        int i = 0;
        for (auto _ : run) {
          benchmark::DoNotOptimize(calls.call(task, what, i));
          benchmark::DoNotOptimize(calls.dq.data());
          if (states == 1 && ++i == batch_size) i = 0;
        }
        count(run, 0, states);
      })
      ->Unit(benchmark::kMicrosecond);
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  for (const Task task : {Task::acceleration, Task::torque, Task::step, Task::operational})
    for (const int states : {1, batch_size})
      for (const Of what : {Of::result, Of::vjp, Of::vjp_inertias, Of::jvp})
        if (task != Task::operational || what != Of::jvp) add<T>(c, task, what, states);
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed) {
  for (const Scene& scene : scenes) {
    const auto c = std::make_shared<const Case>(scene, seed);
    add_all<double>(c);
    add_all<float>(c);
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  return Driver{"bench_gradients",
                "Time of products of Jacobians with vectors, beside the calls that they derive.",
                timed_call}
      .run(argc, argv, add_scenes);
}
