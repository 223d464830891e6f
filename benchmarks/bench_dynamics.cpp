// bench_dynamics: time of forward dynamics by the fast path, one state and batches, in its
// conventional form and its square-root form, against Sequential<Conventional>.
//
// Names are task/variant/scene/precision. Everything is verified before it is timed, against the
// float64 square-root filter: a failed or wrong result is reported as an error and is not timed.
// Counters: flops of a state (fast path only; sines and cosines are not counted), flops per second,
// and for batches the time per state.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "algorithms/structured/dynamics.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/context.hpp"
#include "benchmarks/flops.hpp"
#include "robots/program.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to the acceleration: kinematics, velocity and bias terms, gravity, the "
    "test "
    "for singularity. Memory is taken before. acceleration: one state a call, the next of a pool. "
    "acceleration_batch: all states of the pool in one call on one core, from row-major arrays to "
    "row-major arrays.";

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

template <class Form>
double flops_of(const Case& c) {
  return acceleration_flops<Form>(c.scene.model, c.states[0].q, c.states[0].qd, c.states[0].tau);
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
  benchmark::RegisterBenchmark(
      name_of("acceleration", variant, c->scene.name, std::is_same_v<T, float>).c_str(), run_one)
      ->Unit(benchmark::kNanosecond);
}

template <class T, class Form>
void add_batch(const std::string& variant, std::shared_ptr<const Case> c,
               std::shared_ptr<const Pool<T>> pool) {
  auto batch = std::make_shared<StructuredBatch<T, Form>>(c->scene.model.cast<T>());
  const double flops = flops_of<Form>(*c);
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
  benchmark::RegisterBenchmark(
      name_of("acceleration_batch", variant, c->scene.name, std::is_same_v<T, float>).c_str(),
      run_batch)
      ->Unit(benchmark::kMicrosecond);
}

template <class T, class Form>
void add_form(const std::string& variant, std::shared_ptr<const Case> c,
              std::shared_ptr<const Pool<T>> pool) {
  const Model<T> model = c->scene.model.cast<T>();
  add_one<T>(variant, std::make_shared<StructuredDynamics<T, Form>>(model), flops_of<Form>(*c), c,
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
    const auto c = std::make_shared<const Case>(load_scene(what), seed);
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
