// bench_generated: time of a state by the library's loops and by generated code (kalmarm/kernels.hpp), of calls of one
// state and of rows on one core: which is faster for a robot, from how many rows on.
//
// Names are TASK@ROWS/KERNELS/scene/precision; tasks are acceleration, inverse_dynamics, mass, inverse and derivatives;
// @1 is one state. Everything is verified before it is timed (case.hpp; torques within 1000 nv u of Newton's and Euler's;
// derivatives by derivative_check.hpp). What is compiled, and what the loops answer after all, goes to standard error.
// Counters: time per state.
#include <benchmark/benchmark.h>

#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/derivative_check.hpp"
#include "benchmarks/driver.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From row-major arrays of q, qd and tau (mass, inverse: q; inverse_dynamics: tau's numbers as "
    "qdd) of so many states to the row-major array of their results, by Dynamics: with its tests "
    "of what rounding does to accelerations and M^-1; derivatives: all three, and a. Matrices have "
    "both triangles. Memory is taken before.";

constexpr int rows_of_calls[] = {1, 2, 4, 8, 16, 64};
constexpr int most_rows = 64;

template <class T>
struct Task {
  std::string name;
  Want want;
  std::ptrdiff_t width;  // numbers of a state's result
  // Of the first `rows` states; returns how many failed.
  std::function<int(Dynamics<T>&, std::ptrdiff_t rows, std::vector<T>& result)> call;
  std::function<std::string(int i, const std::vector<T>& result)> judge;  // of state i
};

template <class T>
std::vector<Task<T>> tasks_of(std::shared_ptr<const Case> c) {
  const auto pool = std::make_shared<const Pool<T>>(c->states);
  const Model<double>& model = c->scene.model;
  const std::ptrdiff_t nq = model.nq(), nv = model.nv();
  const auto outcomes = std::make_shared<std::vector<Outcome>>(most_rows);
  using Out = std::vector<T>;
  const auto rows = [](const Out& x, std::ptrdiff_t count, std::ptrdiff_t width) {
    return RowsView<const T>(x.data(), count, width);
  };
  const auto judged = [=](std::ptrdiff_t count) { return std::span(outcomes->data(), count); };
  const auto matrix = [nv](const Out& X, std::ptrdiff_t i) -> MatrixX<T> {
    return Eigen::Map<const MatrixX<T>>(&X[i * nv * nv], nv, nv);
  };
  const auto vector = [nv](const Out& x, std::ptrdiff_t i) -> VectorX<T> {
    return Eigen::Map<const VectorX<T>>(&x[i * nv], nv);
  };
  const std::shared_ptr<Solver<double>> reference =
      make_solver<double>("Sequential<ArrayMGS>", model);
  // The three matrices, each of most_rows states, then a.
  const auto block = [nv](auto& X, std::ptrdiff_t j) { return &X[j * most_rows * nv * nv]; };
  const Task<T> derivatives = {
      "derivatives", Want::derivatives, 3 * nv * nv + nv,
      [=](Dynamics<T>& robot, std::ptrdiff_t n, Out& X) {
        const auto out = [&](std::ptrdiff_t j) { return RowsView<T>(block(X, j), n, nv * nv); };
        return robot.derivatives(rows(pool->q_rows, n, nq), rows(pool->qd_rows, n, nv),
                                 rows(pool->tau_rows, n, nv),
                                 {.dq = out(0), .dqd = out(1), .dtau = out(2)},
                                 RowsView<T>(block(X, 3), n, nv), judged(n));
      },
      [=](int i, const Out& X) -> std::string {
        const auto of = [&](std::ptrdiff_t j) {
          return MatrixX<double>(Eigen::Map<const MatrixX<T>>(block(X, j) + i * nv * nv, nv, nv)
                                     .template cast<double>());
        };
        const double error =
            derivative_error(c->scene.model, *reference, c->states[i], of(0), of(1), of(2));
        const double bound = derivative_bound(c->template bound<T>(c->condition[i]));
        return error <= bound ? "" : wrong(error, bound);
      }};
  return {derivatives,
          {"acceleration", Want::acceleration, nv,
           [=](Dynamics<T>& robot, std::ptrdiff_t n, Out& a) {
             return robot.forward_dynamics(rows(pool->q_rows, n, nq), rows(pool->qd_rows, n, nv),
                                           rows(pool->tau_rows, n, nv),
                                           RowsView<T>(a.data(), n, nv), judged(n));
           },
           [=](int i, const Out& a) { return c->judge(i, vector(a, i)); }},
          {"inverse_dynamics", Want::inverse_dynamics, nv,
           [=](Dynamics<T>& robot, std::ptrdiff_t n, Out& tau) {
             robot.inverse_dynamics(rows(pool->q_rows, n, nq), rows(pool->qd_rows, n, nv),
                                    rows(pool->tau_rows, n, nv), RowsView<T>(tau.data(), n, nv), 1);
             return 0;
           },
           [=](int i, const Out& tau) {
             return c->template compare<T>(torque(c->scene.model, c->states[i]), vector(tau, i), 1);
           }},
          {"mass", Want::mass, nv * nv,
           [=](Dynamics<T>& robot, std::ptrdiff_t n, Out& M) {
             return robot.mass(rows(pool->q_rows, n, nq), RowsView<T>(M.data(), n, nv * nv),
                               judged(n));
           },
           [=](int i, const Out& M) { return c->template compare<T>(c->M[i], matrix(M, i), 1); }},
          {"inverse", Want::inverse, nv * nv,
           [=](Dynamics<T>& robot, std::ptrdiff_t n, Out& X) {
             return robot.inverse_mass(rows(pool->q_rows, n, nq), RowsView<T>(X.data(), n, nv * nv),
                                       judged(n));
           },
           [=](int i, const Out& X) {
             return c->template compare<T>(c->X[i], matrix(X, i), c->condition[i]);
           }}};
}

template <class T>
void add(const Task<T>& task, const std::string& kernels, std::shared_ptr<Dynamics<T>> robot,
         std::shared_ptr<const Case> c) {
  for (const int rows : rows_of_calls)
    benchmark::RegisterBenchmark(
        name_of<T>(task.name + "@" + std::to_string(rows), kernels, *c).c_str(),
        [=](benchmark::State& run) {
          std::vector<T> result(most_rows * task.width);
          std::string flaw = c->flaw;
          if (const int failed = task.call(*robot, rows, result); failed > 0)
            flaw = std::to_string(failed) + " states failed";
          for (int i = 0; i < std::min(rows, c->verified()) && flaw.empty(); ++i)
            flaw = task.judge(i, result);
          if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
          for (auto _ : run) {
            benchmark::DoNotOptimize(task.call(*robot, rows, result));
            benchmark::DoNotOptimize(result.data());
          }
          count(run, 0, rows);
        })
        ->Unit(benchmark::kNanosecond);
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  for (const Task<T>& task : tasks_of<T>(c))
    for (const Kernels kernels : {Kernels::loops, Kernels::generated}) {
      const bool is_generated = kernels == Kernels::generated;
      const auto robot = std::make_shared<Dynamics<T>>(
          plain(c->scene.model),
          DynamicsOptions{.question = {.want = {task.want}}, .kernels = kernels});
      if (is_generated)
        for (const std::string& note : robot->notes())
          std::cerr << c->scene.name << ": " << note << '\n';
      add(task, is_generated ? "generated" : "loops", robot, c);
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
  return Driver{"bench_generated",
                "Time of generated code beside that of the library's loops, by rows of a call.",
                timed_call,
                "",
                {"iiwa14", "panda", "go2", "g1"}}
      .run(argc, argv, add_scenes);
}
