// bench_batch: time of forward dynamics of 1024 states of one robot in one call, by the fast path
// in its conventional form and its square-root form, on one core and on all.
//
// Names are task/variant/scene/precision; a variant that ends in "@all cores" is a ThreadedBatch.
// Everything is verified before it is timed (case.hpp). Counters: flops of a state (sines and
// cosines are not counted), flops per second, time per state.
#include <benchmark/benchmark.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/structured/flops.hpp"
#include "algorithms/structured/threaded_batch.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From row-major arrays of q, qd and tau of 1024 states to the row-major array of their "
    "accelerations: conversion to lanes and back, kinematics, velocity and bias terms, gravity, "
    "the "
    "test for singularity. Memory is taken before.";

template <class T, class Batch>
void add(const std::string& variant, std::shared_ptr<Batch> batch, double flops,
         std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool) {
  benchmark::RegisterBenchmark(
      name_of<T>("acceleration_batch", variant, *c).c_str(),
      [=](benchmark::State& run) {
        const int nv = c->scene.model.nv();
        std::vector<T> a(batch_size * nv, std::numeric_limits<T>::quiet_NaN());
        std::vector<Outcome> outcomes(batch_size);
        const auto call = [&] {
          return batch->acceleration(batch_size, pool->q_rows.data(), pool->qd_rows.data(),
                                     pool->tau_rows.data(), a.data(), outcomes.data());
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

template <class T, class Form>
void add_form(const std::string& variant, std::shared_ptr<const Case> c,
              std::shared_ptr<const Pool<T>> pool) {
  const State& s = c->states[0];
  const double flops = acceleration_flops<Form>(c->scene.model, s.q, s.qd, s.tau);
  const Model<T> model = c->scene.model.cast<T>();
  add<T>(variant, std::make_shared<StructuredBatch<T, Form>>(model), flops, c, pool);
  add<T>(variant + "@all cores", std::make_shared<ThreadedBatch<T, Form>>(model), flops, c, pool);
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  auto pool = std::make_shared<const Pool<T>>(c->states);
  add_form<T, CovarianceForm>("Structured", c, pool);
  add_form<T, SquareRootForm>("StructuredSquareRoot", c, pool);
}

void add_scenes(const std::vector<std::string>& scenes, std::uint64_t seed) {
  for (const std::string& what : scenes) {
    const auto c = std::make_shared<const Case>(load_scene(what), seed);
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
