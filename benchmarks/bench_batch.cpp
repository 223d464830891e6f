// bench_batch: time of forward dynamics of 1024 states of one robot in one call, by the fast path
// in its conventional form and its square-root form, on one core and on all.
//
// Names are task/variant/scene/precision; a variant that ends in "@all cores" takes as many threads as
// there are.
// Everything is verified before it is timed (case.hpp). Counters: flops of a state (sines and
// cosines are not counted), flops per second, time per state.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "algorithms/dynamics/flops.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From row-major arrays of q, qd and tau of 1024 states to the row-major array of their "
    "accelerations: conversion to lanes and back, kinematics, velocity and bias terms, gravity, "
    "the "
    "test for singularity. Memory is taken before.";

template <class T>
void add(const std::string& variant, Form form, int threads, std::shared_ptr<const Case> c,
         std::shared_ptr<const Pool<T>> pool) {
  const double flops = flops_of(c->scene.model, Want::acceleration, form);
  const auto robot = std::make_shared<Dynamics<T>>(
      plain(c->scene.model),
      DynamicsOptions{.form = form, .question = {.want = {Want::acceleration}}});
  benchmark::RegisterBenchmark(
      name_of<T>("acceleration_batch", variant, *c).c_str(),
      [=](benchmark::State& run) {
        const int nv = c->scene.model.nv();
        std::vector<T> a(batch_size * nv, std::numeric_limits<T>::quiet_NaN());
        std::vector<Outcome> outcomes(batch_size);
        const auto call = [&] {
          return robot->forward_dynamics(pool->q_rows, pool->qd_rows, pool->tau_rows, a, outcomes,
                                         threads);
        };
        std::string flaw = c->flaw;
        if (const int failed = call(); failed > 0) flaw = std::to_string(failed) + " states failed";
        for (int i = 0; i < c->verified() && flaw.empty(); ++i)
          flaw = c->judge(i, VectorX<T>(Eigen::Map<const VectorX<T>>(&a[i * nv], nv)));
        if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
        for (auto _ : run) {
          benchmark::DoNotOptimize(call());
          benchmark::DoNotOptimize(a.data());
        }
        count(run, flops, batch_size);
      })
      ->Unit(benchmark::kMicrosecond)
      ->UseRealTime();
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  auto pool = std::make_shared<const Pool<T>>(c->states);
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (const RegisteredVariant<T>& variant : fast_variants<T>()) {
    add<T>(variant.name, variant.traits.form, 1, c, pool);
    add<T>(variant.name + "@all cores", variant.traits.form, cores, c, pool);
  }
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
  return Driver{"bench_batch", "Time of forward dynamics of many states by the fast path.",
                timed_call}
      .run(argc, argv, add_scenes);
}
