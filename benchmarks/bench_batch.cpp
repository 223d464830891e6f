// bench_batch: time of 1024 states of one robot in one call, by the ladder at its tolerances, on one core
// and on all: forward dynamics, M, M^-1, its diagonal, M^-1 tau and derivatives.
//
// Names are task/variant/scene/precision; tasks are acceleration_batch, mass_batch, inverse_batch,
// diagonal_batch, solve_batch and derivatives_batch; a variant that ends in "@all cores" takes as many
// threads as there are. M and derivatives are the same at all
// tolerances; with --ladder accelerations and M^-1 are timed at those of exhibits too. Matrices of 1024 states that take more than 256 MiB are left out.
// Everything is verified before it is timed (case.hpp). Counters: flops of a state (sines and
// cosines are not counted), flops per second, time per state.
#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "algorithms/study/flops/flops.hpp"
#include "algorithms/study/solver.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/derivative_check.hpp"
#include "benchmarks/driver.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From row-major arrays of q, qd and tau (mass, inverse, diagonal: q; solve: q and tau) of 1024 "
    "states to the row-major array of their results (derivatives: a, and those by q, qd and tau): "
    "conversion to lanes and back, kinematics, velocity and bias "
    "terms, gravity, the test for singularity. Matrices have both triangles. Memory is taken "
    "before.";

// Of a longer chain the last resort answers nearly every refined diagonal and M^-1, at milliseconds a
// state: a benchmark would take minutes.
constexpr int most_refined = 40;

template <class T>
struct Batch {
  std::string name;  // of the task
  Want want;
  std::ptrdiff_t width;  // numbers of a state's result
  double flops;          // 0: not known
  // Of the rows; returns how many failed.
  std::function<int(Dynamics<T>&, std::vector<T>& result, std::vector<Outcome>& outcomes,
                    int threads)>
      call;
  std::function<std::string(int i, const std::vector<T>& result)> judge;  // of state i
};

template <class T>
void add(const Batch<T>& batch, const std::string& variant, std::optional<double> tolerance,
         int threads, std::shared_ptr<const Case> c) {
  const auto robot = std::make_shared<Dynamics<T>>(
      plain(c->scene.model),
      DynamicsOptions{.tolerance = tolerance, .question = {.want = {batch.want}}});
  benchmark::RegisterBenchmark(
      name_of<T>(batch.name, variant, *c).c_str(),
      [=](benchmark::State& run) {
        std::vector<T> result(batch_size * batch.width, std::numeric_limits<T>::quiet_NaN());
        std::vector<Outcome> outcomes(batch_size);
        const auto call = [&] { return batch.call(*robot, result, outcomes, threads); };
        std::string flaw = c->flaw;
        if (const int failed = call(); failed > 0) flaw = std::to_string(failed) + " states failed";
        for (int i = 0; i < c->verified() && flaw.empty(); ++i) flaw = batch.judge(i, result);
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
std::vector<Batch<T>> batches(std::shared_ptr<const Case> c, const VariantTraits& traits) {
  const auto pool = std::make_shared<const Pool<T>>(c->states);
  const Model<double>& model = c->scene.model;
  const int nv = model.nv();
  const std::ptrdiff_t size = std::ptrdiff_t(nv) * nv;
  // Of refined factors the flops are not known.
  const auto flops = [&](Want want) {
    const bool known = want == Want::acceleration || !traits.refined;
    const CallKind call = {.rows = true};
    return known ? flops_of(model, want, traits.tolerance, call) : 0.0;
  };
  using Rows = std::vector<T>;
  using Outcomes = std::vector<Outcome>;
  const auto vector = [nv](const Rows& x, std::ptrdiff_t i) -> VectorX<T> {
    return Eigen::Map<const VectorX<T>>(&x[i * nv], nv);
  };
  const auto matrix = [nv, size](const Rows& X, std::ptrdiff_t i) -> MatrixX<T> {
    return Eigen::Map<const MatrixX<T>>(&X[i * size], nv, nv);
  };
  std::vector<Batch<T>> out;
  out.push_back({"acceleration_batch", Want::acceleration, nv, flops(Want::acceleration),
                 [=](Dynamics<T>& robot, Rows& a, Outcomes& outcomes, int threads) {
                   return robot.forward_dynamics(pool->q_rows, pool->qd_rows, pool->tau_rows, a,
                                                 outcomes, threads);
                 },
                 [=](int i, const Rows& a) { return c->judge(i, vector(a, i)); }});
  out.push_back({"solve_batch", Want::solve, nv, flops(Want::solve),
                 [=](Dynamics<T>& robot, Rows& x, Outcomes& outcomes, int threads) {
                   return robot.solve(pool->q_rows, pool->tau_rows, x, outcomes, threads);
                 },
                 [=](int i, const Rows& x) {
                   return c->template compare<T>(c->X[i] * c->states[i].tau, vector(x, i),
                                                 c->condition[i]);
                 }});
  if (traits.refined && nv > most_refined) return out;
  out.push_back({"diagonal_batch", Want::diagonal, nv, 0,
                 [=](Dynamics<T>& robot, Rows& x, Outcomes& outcomes, int threads) {
                   return robot.diagonal(pool->q_rows, x, outcomes, threads);
                 },
                 [=](int i, const Rows& x) {
                   return c->template compare<T>(c->X[i].diagonal().eval(), vector(x, i),
                                                 c->condition[i]);
                 }});
  if (size * batch_size * std::ptrdiff_t(sizeof(T)) > std::ptrdiff_t(256) << 20) return out;
  out.push_back({"inverse_batch", Want::inverse, size, flops(Want::inverse),
                 [=](Dynamics<T>& robot, Rows& X, Outcomes& outcomes, int threads) {
                   return robot.inverse_mass(pool->q_rows, X, outcomes, threads);
                 },
                 [=](int i, const Rows& X) {
                   return c->template compare<T>(c->X[i], matrix(X, i), c->condition[i]);
                 }});
  if (traits.refined) return out;
  out.push_back(
      {"mass_batch", Want::mass, size, flops(Want::mass),
       [=](Dynamics<T>& robot, Rows& M, Outcomes& outcomes, int threads) {
         return robot.mass(pool->q_rows, M, outcomes, threads);
       },
       [=](int i, const Rows& M) { return c->template compare<T>(c->M[i], matrix(M, i), 1); }});
  // The result has dq of all states, then dqd, then dtau, then a.
  const std::shared_ptr<Solver<double>> reference =
      make_solver<double>("Sequential<ArrayMGS>", model);
  out.push_back({"derivatives_batch", Want::derivatives, 3 * size + nv, flops(Want::derivatives),
                 [=](Dynamics<T>& robot, Rows& all, Outcomes& outcomes, int threads) {
                   const auto rows = [&](std::ptrdiff_t first, std::ptrdiff_t width) {
                     return RowsView<T>(&all[first * batch_size], batch_size, width);
                   };
                   return robot.derivatives(
                       pool->q_rows, pool->qd_rows, pool->tau_rows,
                       {.dq = rows(0, size), .dqd = rows(size, size), .dtau = rows(2 * size, size)},
                       rows(3 * size, nv), outcomes, threads);
                 },
                 [=](int i, const Rows& all) {
                   const auto of = [&](int which) -> MatrixX<double> {
                     return matrix(all, i + which * batch_size).template cast<double>();
                   };
                   const double error = derivative_error(c->scene.model, *reference, c->states[i],
                                                         of(0), of(1), of(2));
                   const double bound = derivative_bound(c->template bound<T>(c->condition[i]));
                   return error <= bound ? "" : wrong(error, bound);
                 }});
  return out;
}

template <class T>
void add_all(std::shared_ptr<const Case> c, bool every_tolerance) {
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (const RegisteredVariant<T>& variant : ladder_variants<T>()) {
    const VariantTraits& traits = variant.traits;
    if (!traits.contender && !every_tolerance) continue;
    for (const Batch<T>& batch : batches<T>(c, traits)) {
      const bool in_figure = batch.want == Want::acceleration || batch.want == Want::inverse;
      if (traits.contender || in_figure) add(batch, variant.name, traits.tolerance, 1, c);
      if (traits.contender) add(batch, variant.name + "@all cores", traits.tolerance, cores, c);
    }
  }
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed, bool every_tolerance) {
  for (const Scene& scene : scenes) {
    const auto c = std::make_shared<const Case>(scene, seed);
    add_all<double>(c, every_tolerance);
    add_all<float>(c, every_tolerance);
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  bool every_tolerance = false;
  return Driver{"bench_batch", "Time of the dynamics of many states in one call by the ladder.",
                timed_call, "[--ladder] "}
      .run(
          argc, argv,
          [&](const std::vector<Scene>& scenes, std::uint64_t seed) {
            add_scenes(scenes, seed, every_tolerance);
          },
          [&](CLI::App& app) {
            app.add_flag("--ladder", every_tolerance, "a and M^-1 at every tolerance");
          });
}
