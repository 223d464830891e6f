// bench_batch: time of 1024 states of one robot in one call, by the fast path in its forms, on one core
// and on all: forward dynamics, M, M^-1 and M^-1 tau.
//
// Names are task/variant/scene/precision; tasks are acceleration_batch, mass_batch, inverse_batch and
// solve_batch; a variant that ends in "@all cores" takes as many threads as there are. M is the same
// for all forms. Matrices of 1024 states that take more than 256 MiB are left out.
// Everything is verified before it is timed (case.hpp). Counters: flops of a state (sines and
// cosines are not counted), flops per second, time per state.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <functional>
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
    "From row-major arrays of q, qd and tau (mass, inverse: q; solve: q and tau) of 1024 states to "
    "the "
    "row-major array of their results: conversion to lanes and back, kinematics, velocity and bias "
    "terms, gravity, the test for singularity. Matrices have both triangles. Memory is taken "
    "before.";

template <class T>
struct Batch {
  std::string name;  // of the task
  Want want;
  std::ptrdiff_t width;  // of a state's result
  double flops;          // 0: not known
  // Of the rows; returns how many failed.
  std::function<int(Dynamics<T>&, std::vector<T>& result, std::vector<Outcome>& outcomes,
                    int threads)>
      call;
  std::function<std::string(int i, const T* result)> judge;  // of state i
};

template <class T>
void add(const Batch<T>& batch, const std::string& variant, Form form, int threads,
         std::shared_ptr<const Case> c) {
  const auto robot = std::make_shared<Dynamics<T>>(
      plain(c->scene.model), DynamicsOptions{.form = form, .question = {.want = {batch.want}}});
  benchmark::RegisterBenchmark(
      name_of<T>(batch.name, variant, *c).c_str(),
      [=](benchmark::State& run) {
        std::vector<T> result(batch_size * batch.width, std::numeric_limits<T>::quiet_NaN());
        std::vector<Outcome> outcomes(batch_size);
        const auto call = [&] { return batch.call(*robot, result, outcomes, threads); };
        std::string flaw = c->flaw;
        if (const int failed = call(); failed > 0) flaw = std::to_string(failed) + " states failed";
        for (int i = 0; i < c->verified() && flaw.empty(); ++i)
          flaw = batch.judge(i, &result[i * batch.width]);
        if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
        for (auto _ : run) {
          benchmark::DoNotOptimize(call());
          benchmark::DoNotOptimize(result.data());
        }
        count(run, batch.flops, batch_size);
      })
      ->Unit(benchmark::kMicrosecond)
      ->UseRealTime();
}

template <class T>
std::vector<Batch<T>> batches(std::shared_ptr<const Case> c, Form form) {
  const auto pool = std::make_shared<const Pool<T>>(c->states);
  const Model<double>& model = c->scene.model;
  const int nv = model.nv();
  const auto vector = [nv](const T* x) -> VectorX<T> {
    return Eigen::Map<const VectorX<T>>(x, nv);
  };
  const auto matrix = [nv](const T* X) -> MatrixX<T> {
    return Eigen::Map<const MatrixX<T>>(X, nv, nv);
  };
  using Rows = std::vector<T>;
  using Outcomes = std::vector<Outcome>;
  std::vector<Batch<T>> out;
  out.push_back({"acceleration_batch", Want::acceleration, nv,
                 flops_of(model, Want::acceleration, form),
                 [=](Dynamics<T>& robot, Rows& a, Outcomes& outcomes, int threads) {
                   return robot.forward_dynamics(pool->q_rows, pool->qd_rows, pool->tau_rows, a,
                                                 outcomes, threads);
                 },
                 [=](int i, const T* a) { return c->judge(i, vector(a)); }});
  out.push_back({"solve_batch", Want::solve, nv, 0,
                 [=](Dynamics<T>& robot, Rows& x, Outcomes& outcomes, int threads) {
                   return robot.solve(pool->q_rows, pool->tau_rows, x, outcomes, threads);
                 },
                 [=](int i, const T* x) {
                   return c->template compare<T>(c->X[i] * c->states[i].tau, vector(x),
                                                 c->condition[i]);
                 }});
  const std::ptrdiff_t size = std::ptrdiff_t(nv) * nv;
  if (size * batch_size * std::ptrdiff_t(sizeof(T)) > std::ptrdiff_t(256) << 20) return out;
  out.push_back({"inverse_batch", Want::inverse, size, flops_of(model, Want::inverse, form),
                 [=](Dynamics<T>& robot, Rows& X, Outcomes& outcomes, int threads) {
                   return robot.inverse_mass(pool->q_rows, X, outcomes, threads);
                 },
                 [=](int i, const T* X) {
                   return c->template compare<T>(c->X[i], matrix(X), c->condition[i]);
                 }});
  if (form == Form::conventional)
    out.push_back(
        {"mass_batch", Want::mass, size, flops_of(model, Want::mass, form),
         [=](Dynamics<T>& robot, Rows& M, Outcomes& outcomes, int threads) {
           return robot.mass(pool->q_rows, M, outcomes, threads);
         },
         [=](int i, const T* M) { return c->template compare<T>(c->M[i], matrix(M), 1); }});
  return out;
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (const RegisteredVariant<T>& variant : fast_variants<T>())
    for (const Batch<T>& batch : batches<T>(c, variant.traits.form)) {
      add(batch, variant.name, variant.traits.form, 1, c);
      add(batch, variant.name + "@all cores", variant.traits.form, cores, c);
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
  return Driver{"bench_batch", "Time of the dynamics of many states in one call by the fast path.",
                timed_call}
      .run(argc, argv, add_scenes);
}
