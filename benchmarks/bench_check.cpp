// bench_check: time of checks of 1024 accelerations in one call on one core, beside that of accelerations.
//
// Names are task/variant/scene/precision: acceleration_batch/Ladder<default> are Dynamics<double>'s, each
// check_batch/... is of answers to the same states, rounded to float32 or as they are, whose errors are all told
// or need not be told apart below 1e-8 (kalmarm/check.hpp). Every verdict is `right`, or nothing is timed.
#include <benchmark/benchmark.h>

#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "kalmarm/check.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From row-major arrays of q, qd and tau of 1024 states, and of their accelerations, to these "
    "or to an "
    "AnswerError each. Memory is taken before.";

struct Rows {
  Pool<double> pool;
  std::vector<double> a, narrow;  // narrow: a rounded to float32
};

void add(const std::string& name, const std::function<int()>& call) {
  benchmark::RegisterBenchmark(
      name.c_str(),
      [=](benchmark::State& run) {
        if (const int failed = call(); failed > 0)
          return run.SkipWithError((std::to_string(failed) + " states failed").c_str());
        for (auto _ : run) benchmark::DoNotOptimize(call());
        count(run, 0, batch_size);
      })
      ->Unit(benchmark::kMicrosecond)
      ->UseRealTime();
}

void add_check(const std::string& variant, const Case& c, std::shared_ptr<const Rows> rows,
               const std::vector<double> Rows::*answers, const AnswerCheckOptions& options) {
  const auto check = std::make_shared<AnswerCheck>(plain(c.scene.model), options);
  const auto errors = std::make_shared<std::vector<AnswerError>>(batch_size);
  add(name_of<double>("check_batch", variant, c), [=] {
    return check->forward_dynamics(rows->pool.q_rows, rows->pool.qd_rows, rows->pool.tau_rows,
                                   (*rows).*answers, *errors);
  });
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed) {
  for (const Scene& scene : scenes) {
    const Case c(scene, seed);
    const auto rows = std::make_shared<Rows>(Rows{Pool<double>(c.states), {}, {}});
    rows->a.resize(batch_size * c.scene.model.nv());
    const auto robot = std::make_shared<Dynamics<double>>(
        plain(c.scene.model), DynamicsOptions{.question = {.want = {Want::acceleration}}});
    const auto outcomes = std::make_shared<std::vector<Outcome>>(batch_size);
    const auto answer = [=] {
      return robot->forward_dynamics(rows->pool.q_rows, rows->pool.qd_rows, rows->pool.tau_rows,
                                     rows->a, *outcomes);
    };
    static_cast<void>(answer());
    rows->narrow.assign(rows->a.begin(), rows->a.end());
    for (double& x : rows->narrow) x = static_cast<float>(x);
    add(name_of<double>("acceleration_batch", "Ladder<default>", c), answer);
    add_check("float32_answers", c, rows, &Rows::narrow, {.tolerance = 1e-2});
    add_check("float64_answers@1e-8", c, rows, &Rows::a, {.resolution = 1e-8});
    add_check("float64_answers", c, rows, &Rows::a, {});
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  return Driver{"bench_check", "Time of checks of accelerations beside that of accelerations.",
                timed_call}
      .run(argc, argv, add_scenes);
}
