// bench_estimation: what the paper's sections cost against N, on the random chain. The recursions
// of algorithms/study/estimation/ are O(N), Result 6.1 is O(N^2), the literal operators are O(N^3) and
// end at largest_dense. The fast path goes on to a million links.
//
// Names are task/variant/chain:N/precision. Each case is verified before it is timed: the filter
// and smoother, the fast path, and M^-1, against the library's Sequential<Conventional>; log det M
// by its gradient, which sums up to the number of joints, since M is homogeneous in its parameters.
#include <benchmark/benchmark.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/derivatives/log_det.hpp"
#include "algorithms/study/estimation/filter_smoother.hpp"
#include "algorithms/study/estimation/operators.hpp"
#include "algorithms/study/solver.hpp"
#include "benchmarks/run.hpp"
#include "robots/scene/families.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "One state of the random chain, memory taken before, except in operators. covariances: the "
    "process' r, P, D, g and Lambda. filter_smoother: z, e, lambda and a, given the covariances. "
    "log_det_gradient: from Lambda. acceleration and inverse: the library's kernels, kinematics "
    "included. operators: phi, Q, R, M, Psi, K, L, dense.";

constexpr const char* library = "Sequential<Conventional>";
constexpr int largest_recursion = 100'000;  // beyond, the covariances take gigabytes
constexpr double rounding = 1e-6;           // to catch what is wrong, not what is inexact

struct Chain {
  Scene scene;
  State state;
  Process<double> process;
  Covariances<double> cov;
  FilterSmoother<double> fs;
  VectorX<double> a;  // by the library
  std::string flaw;

  Chain(int links, std::uint64_t seed)
      : scene(generated_scene("chain:" + std::to_string(links), random_chain(links, seed, 1))),
        state(random_states(scene, 1, seed).front()),
        process(at(scene.model, state)),
        cov(process),
        fs(process),
        a(links) {
    const auto solver = make_solver<double>(library, scene.model);
    const Outcome outcome = set_state_covariances(process, cov);
    if (!outcome || !solver->acceleration(state.q, state.qd, state.tau, a)) {
      flaw = "singular";
      return;
    }
    set_co_state_covariances(process, cov);
    filter(process, cov, state.tau, fs);
    smooth(process, cov, fs);
    if (!((fs.a - a).norm() <= rounding * a.norm())) flaw = "wrong acceleration";
  }

  static Process<double> at(const Model<double>& model, const State& state) {
    LinkKinematics<double> kin(model);
    set_position(model, state.q, kin);
    set_velocity(model, state.qd, kin);
    return Process<double>(model, kin);
  }
};

// sum over the links of d log det M / d theta . theta = N.
std::string verify_gradient(const Chain& c) {
  const LogDetGradient<double> gradient = log_det_gradient(c.cov);
  double sum = 0;
  for (int k = 0; k < c.process.size(); ++k) {
    const SpatialInertia<double>& M = c.scene.model.M(k);
    InertialVector<double> theta;
    theta << M.m, M.h, M.I(0, 0), M.I(1, 1), M.I(2, 2), M.I(0, 1), M.I(0, 2), M.I(1, 2);
    sum += gradient.inertia[k].dot(theta);
  }
  return std::abs(sum / c.process.size() - 1) <= rounding ? "" : "wrong gradient";
}

void add(const std::string& name, int links, const std::function<std::string()>& verify,
         const std::function<void()>& call) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& run) {
    if (const std::string flaw = verify(); !flaw.empty()) {
      run.SkipWithError(flaw.c_str());
      return;
    }
    for (auto _ : run) {
      call();
      benchmark::ClobberMemory();
    }
    run.counters["s/link"] = benchmark::Counter(
        links, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  })->Unit(benchmark::kNanosecond);
}

void add(const std::string& task, const std::string& variant, const Chain& c,
         const std::function<std::string()>& verify, const std::function<void()>& call) {
  add(
      task + "/" + variant + "/" + c.scene.name + "/float64", c.process.size(),
      [verify, flaw = c.flaw] { return flaw.empty() ? verify() : flaw; }, call);
}

std::string sound() { return ""; }

void add_recursions(const std::shared_ptr<Chain>& c) {
  add("covariances", "recursion", *c, sound, [c] {
    benchmark::DoNotOptimize(set_state_covariances(c->process, c->cov));
    set_co_state_covariances(c->process, c->cov);
  });
  add("filter_smoother", "recursion", *c, sound, [c] {
    filter(c->process, c->cov, c->state.tau, c->fs);
    smooth(c->process, c->cov, c->fs);
  });
  add(
      "log_det_gradient", "recursion", *c, [c] { return verify_gradient(*c); },
      [c] { benchmark::DoNotOptimize(log_det_gradient(c->cov).r.data()); });
  const auto solver = std::shared_ptr<Solver<double>>(make_solver<double>(library, c->scene.model));
  add("acceleration", library, *c, sound, [c, solver, a = c->a]() mutable {
    benchmark::DoNotOptimize(solver->acceleration(c->state.q, c->state.qd, c->state.tau, a));
  });
}

// Forward dynamics by the fast path, which needs little memory. It is verified in float64: in
// float32 the library itself loses two digits at a million links.
template <class T>
void add_fast_path(int links, std::uint64_t seed) {
  struct Long {
    Scene scene;
    Model<T> model;
    Dynamics<T> dynamics;
    VectorX<T> q, qd, tau, a;

    Long(int n, std::uint64_t from)
        : scene(generated_scene("chain:" + std::to_string(n), random_chain(n, from, 1))),
          model(scene.model.cast<T>()),
          dynamics(plain(scene.model), {.question = {.want = {Want::acceleration}}}),
          a(n) {
      const State state = random_states(scene, 1, from).front();
      q = state.q.cast<T>();
      qd = state.qd.cast<T>();
      tau = state.tau.cast<T>();
    }
    Outcome call() { return dynamics.forward_dynamics(q, qd, tau, a); }
  };
  const auto c = std::make_shared<Long>(links, seed);
  const auto verify = [c]() -> std::string {
    const auto wide = [](const VectorX<T>& x) {
      return VectorX<double>(x.template cast<double>());
    };
    const auto other = make_solver<double>(library, c->model.template cast<double>());
    VectorX<double> expected(c->a.size());
    if (!c->call() || !other->acceleration(wide(c->q), wide(c->qd), wide(c->tau), expected))
      return "singular";
    const double bound = std::is_same_v<T, float> ? 1e-2 : rounding;
    return (wide(c->a) - expected).norm() <= bound * expected.norm() ? "" : "wrong acceleration";
  };
  const std::string precision = std::is_same_v<T, float> ? "float32" : "float64";
  add("acceleration/Ladder<default>/" + c->scene.name + "/" + precision, links, verify,
      [c] { benchmark::DoNotOptimize(c->call()); });
}

void add_inverse(const std::shared_ptr<Chain>& c, const std::string& variant) {
  const auto solver = std::shared_ptr<Solver<double>>(make_solver<double>(variant, c->scene.model));
  const int n = c->process.size();
  const auto X = std::make_shared<MatrixX<double>>(n, n);
  const auto verify = [=]() -> std::string {
    const auto other = make_solver<double>(library, c->scene.model);
    MatrixX<double> expected(n, n);
    if (!other->inverse(c->state.q, expected) || !solver->inverse(c->state.q, *X))
      return "singular";
    return (*X - expected).norm() <= rounding * expected.norm() ? "" : "wrong inverse";
  };
  add("inverse", variant, *c, verify,
      [=] { benchmark::DoNotOptimize(solver->inverse(c->state.q, *X)); });
}

void add_operators(const std::shared_ptr<Chain>& c) {
  add("operators", "literal", *c, sound, [c] {
    const Operators<double> op(c->process);
    const ClosedLoop<double> loop(c->process, op, c->cov);
    benchmark::DoNotOptimize(loop.L.data());
  });
}

void add_all(int largest, std::uint64_t seed) {
  for (const int links :
       {5, 10, 20, 40, largest_dense, 100, 300, 1000, 3000, 10000, 30000, 100000, 1000000}) {
    if (links > largest) break;
    add_fast_path<double>(links, seed);
    add_fast_path<float>(links, seed);
    if (links > largest_recursion) continue;
    const auto c = std::make_shared<Chain>(links, seed);
    add_recursions(c);
    if (links <= 1000) add_inverse(c, "ClosedForm<Conventional>");
    if (links <= largest_dense) add_operators(c);
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  Benchmarks benchmarks(
      argc, argv,
      "Usage: bench_estimation [--largest N] [--seed S] [flags of Google Benchmark]\n\n");
  CLI::App app("Time of the paper's recursions and operators against N.", "bench_estimation");
  int largest = largest_recursion;
  std::uint64_t seed = 1;
  app.add_option("--largest", largest, "chain that is timed")
      ->check(between(5, 1000000))
      ->capture_default_str();
  app.add_option("--seed", seed, "of the chain and its state")
      ->check(any_seed())
      ->capture_default_str();
  return run_program(app, argc, argv, [&] {
    add_all(largest, seed);
    benchmarks.run(timed_call);
    return 0;
  });
}
