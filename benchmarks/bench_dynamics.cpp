// bench_dynamics: time of forward dynamics by the fast path, one state and batches, in its
// conventional form and its square-root form, against Sequential<Conventional>.
//
// Names are task/variant/scene/precision. Everything is verified before it is timed, against the
// float64 square-root filter: a failed or wrong result is reported as an error and is not timed.
// Counters: flops of a state (fast path only; sines and cosines are not counted), flops per second,
// and for batches the time per state.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/inverse_mass/condition.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/solver.hpp"
#include "algorithms/spatial/count.hpp"
#include "algorithms/structured/dynamics.hpp"
#include "benchmarks/context.hpp"
#include "robots/program.hpp"
#include "robots/scene.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to the acceleration: kinematics, velocity and bias terms, gravity, the "
    "test "
    "for singularity. Memory is taken before. acceleration: one state a call, the next of a pool. "
    "acceleration_batch: all states of the pool in one call on one core, from row-major arrays to "
    "row-major arrays.";

constexpr int batch_size = 1024;
constexpr int verified = 5;

// A scene, its states, and what is right for the first few of them.
struct Case {
  Scene scene;
  std::vector<State> states;
  std::vector<VectorX<double>> a;
  std::vector<double> condition;  // upper bound of that of M scaled to unit diagonal
  std::string flaw;               // why the reference itself failed

  Case(const std::string& what, std::uint64_t seed)
      : scene(load_scene(what)), states(random_states(scene, batch_size, seed)) {
    const int nv = scene.model.nv();
    const auto solver = make_solver<double>("Sequential<ArrayMGS>", scene.model);
    RandomModel<double> rm(scene.model);
    CompositeInertia<double> composite(scene.model);
    MatrixX<double> M(nv, nv), X(nv, nv);
    for (int i = 0; i < verified; ++i) {
      a.emplace_back(nv);
      set_position(scene.model, states[i].q, rm);
      mass_matrix(scene.model, rm, composite, Eigen::Ref<MatrixX<double>>(M));
      Outcome outcome = solver->acceleration(states[i].q, states[i].qd, states[i].tau, a.back());
      if (outcome) outcome = solver->inverse(states[i].q, X);
      if (!outcome) flaw = std::string("reference: ") + to_string(outcome.status);
      condition.push_back(scaled_condition_bound(M, X));
    }
  }

  template <class Form>
  double flops() const {
    const StructuredModel<double> model(scene.model);
    typename Form::template Workspace<Count> ws(model);
    const auto counts = [](const VectorX<double>& x) {
      return std::vector<Count>(x.begin(), x.end());
    };
    const std::vector<Count> q = counts(states[0].q), qd = counts(states[0].qd);
    const std::vector<Count> tau = counts(states[0].tau);
    std::vector<Count> out(model.nv());
    Count::flops = 0;
    Form::acceleration(model, q.data(), qd.data(), tau.data(), ws, out.data());
    return static_cast<double>(Count::flops);
  }

  // "" where the acceleration of state i is right.
  template <class T>
  std::string judge(int i, const VectorX<T>& x) const {
    const double error = (x.template cast<double>() - a[i]).norm() / a[i].norm();
    const double bound =
        1000.0 * scene.model.nv() * static_cast<double>(unit_roundoff<T>()) * condition[i];
    if (error <= bound) return "";
    char text[80];
    std::snprintf(text, sizeof text, "wrong: error %.2g, bound %.2g", error, bound);
    return text;
  }
};

template <class T>
struct Pool {
  std::vector<VectorX<T>> q, qd, tau;
  std::vector<T> q_rows, qd_rows, tau_rows;  // the same, row-major

  explicit Pool(const std::vector<State>& states) {
    const auto put = [](const VectorX<double>& x, std::vector<VectorX<T>>& vectors,
                        std::vector<T>& rows) {
      vectors.push_back(x.cast<T>());
      rows.insert(rows.end(), vectors.back().begin(), vectors.back().end());
    };
    for (const State& state : states) {
      put(state.q, q, q_rows);
      put(state.qd, qd, qd_rows);
      put(state.tau, tau, tau_rows);
    }
  }
};

template <class T>
std::string name_of(const char* task, const std::string& variant, const Case& c) {
  return std::string(task) + "/" + variant + "/" + c.scene.name +
         (std::is_same_v<T, float> ? "/float32" : "/float64");
}

void count(benchmark::State& run, double flops, int states) {
  using benchmark::Counter;
  if (flops > 0) {
    run.counters["flops"] = flops;
    run.counters["FLOP/s"] = Counter(flops * states, Counter::kIsIterationInvariantRate);
  }
  if (states > 1)
    run.counters["s/state"] =
        Counter(states, Counter::kIsIterationInvariantRate | Counter::kInvert);
}

// `solver` is a Solver or a StructuredDynamics.
template <class T, class S>
void add_one(const std::string& variant, std::shared_ptr<S> solver, double flops,
             std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool) {
  const auto run_one = [=](benchmark::State& run) {
    const int nv = c->scene.model.nv();
    VectorX<T> a(nv);
    for (int i = 0; i < verified; ++i) {
      a.setConstant(std::numeric_limits<T>::quiet_NaN());
      const Outcome outcome = solver->acceleration(pool->q[i], pool->qd[i], pool->tau[i], a);
      const std::string flaw = !c->flaw.empty() ? c->flaw
                               : outcome        ? c->judge(i, a)
                                                : std::string(to_string(outcome.status));
      if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
    }
    std::size_t i = 0;
    for (auto _ : run) {
      benchmark::DoNotOptimize(solver->acceleration(pool->q[i], pool->qd[i], pool->tau[i], a));
      benchmark::DoNotOptimize(a.data());
      if (++i == pool->q.size()) i = 0;
    }
    count(run, flops, 1);
  };
  benchmark::RegisterBenchmark(name_of<T>("acceleration", variant, *c).c_str(), run_one)
      ->Unit(benchmark::kNanosecond);
}

template <class T, class Form>
void add_batch(const std::string& variant, std::shared_ptr<const Case> c,
               std::shared_ptr<const Pool<T>> pool) {
  auto batch = std::make_shared<StructuredBatch<T, Form>>(c->scene.model.cast<T>());
  const double flops = c->flops<Form>();
  const auto run_batch = [=](benchmark::State& run) {
    const int nv = c->scene.model.nv();
    std::vector<T> a(batch_size * nv, std::numeric_limits<T>::quiet_NaN());
    std::vector<Outcome> outcomes(batch_size);
    const auto call = [&] {
      return batch->acceleration(batch_size, pool->q_rows.data(), pool->qd_rows.data(),
                                 pool->tau_rows.data(), a.data(), outcomes.data());
    };
    const int failed = call();
    if (failed > 0) return run.SkipWithError((std::to_string(failed) + " states failed").c_str());
    for (int i = 0; i < verified; ++i) {
      const VectorX<T> row = Eigen::Map<const VectorX<T>>(&a[i * nv], nv);
      const std::string flaw = c->flaw.empty() ? c->judge(i, row) : c->flaw;
      if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
    }
    for (auto _ : run) {
      benchmark::DoNotOptimize(call());
      benchmark::DoNotOptimize(a.data());
    }
    count(run, flops, batch_size);
  };
  benchmark::RegisterBenchmark(name_of<T>("acceleration_batch", variant, *c).c_str(), run_batch)
      ->Unit(benchmark::kMicrosecond);
}

template <class T, class Form>
void add_form(const std::string& variant, std::shared_ptr<const Case> c,
              std::shared_ptr<const Pool<T>> pool) {
  const Model<T> model = c->scene.model.cast<T>();
  add_one<T>(variant, std::make_shared<StructuredDynamics<T, Form>>(model), c->flops<Form>(), c,
             pool);
  add_batch<T, Form>(variant, c, pool);
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  const Model<T> model = c->scene.model.cast<T>();
  auto pool = std::make_shared<const Pool<T>>(c->states);
  add_form<T, CovarianceForm>("Structured", c, pool);
  add_form<T, SquareRootForm>("StructuredSquareRoot", c, pool);
  add_one<T>("Sequential<Conventional>",
             std::shared_ptr<Solver<T>>(make_solver<T>("Sequential<Conventional>", model)), 0, c,
             pool);
}

int run(const std::vector<std::string>& scenes, std::uint64_t seed) {
  for (const std::string& what : scenes) {
    const auto c = std::make_shared<const Case>(what, seed);
    add_all<double>(c);
    add_all<float>(c);
  }
  add_context(timed_call);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  choose_openblas_kernels(argv);  // before Initialize takes its flags out of argv
  benchmark::Initialize(&argc, argv, [] {
    std::printf(
        "Usage: bench_dynamics SCENE... [--seed S] [flags of Google Benchmark]\n\n  SCENE: %s\n\n",
        scene_help);
    benchmark::PrintDefaultHelp();
  });
  CLI::App app("Time of forward dynamics by the fast path.", "bench_dynamics");
  std::vector<std::string> scenes;
  std::uint64_t seed = 1;
  app.add_option("SCENE", scenes, scene_help)->required();
  app.add_option("--seed", seed, "of the random states")->capture_default_str();
  return run_program(app, argc, argv, [&] { return run(scenes, seed); });
}
