// bench_inverse: time of forward dynamics, of M^-1 and of M, for every variant, precision and
// scene.
//
// Names are task/variant/scene/precision. Every variant is verified on a few states before it is
// timed, against the float64 square-root filter: a failed or wrong result is reported as an error
// and is not timed. The verification's bound is there to catch what is wrong, not what is inexact;
// the accuracy programs judge that.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/inverse_mass/condition.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/solver.hpp"
#include "benchmarks/context.hpp"
#include "robots/mujoco_solver.hpp"
#include "robots/program.hpp"
#include "robots/scene.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to the result: kinematics, velocity and bias terms, gravity, factorisation "
    "and solution, in "
    "one call, memory taken before. inverse and mass take q alone and write both triangles. Each "
    "call takes the next of "
    "a pool of random states.";

constexpr const char* reference_variant = "Sequential<ArrayMGS>";

template <class T>
struct Pool {
  std::vector<VectorX<T>> q, qd, tau;

  explicit Pool(const std::vector<State>& states) {
    for (const State& state : states) {
      q.push_back(state.q.cast<T>());
      qd.push_back(state.qd.cast<T>());
      tau.push_back(state.tau.cast<T>());
    }
  }
};

// Which joint failed, and how.
std::string describe(const Scene& scene, const Outcome& outcome) {
  const std::string status = to_string(outcome.status);
  return outcome.joint < 0 ? status : status + " at joint " + scene.model.name(outcome.joint);
}

// A scene, its states, and what is right for the first few of them.
struct Case {
  Scene scene;
  std::vector<State> states;
  std::vector<VectorX<double>> a;
  std::vector<MatrixX<double>> M, X;
  std::vector<double> condition;  // upper bound of that of M scaled to unit diagonal
  std::string flaw;               // why the reference itself failed

  explicit Case(const std::string& what, std::uint64_t seed) : scene(load_scene(what)) {
    const int nv = scene.model.nv();
    states = random_states(scene, std::clamp(200000 / nv, 20, 1000), seed);
    const auto solver = make_solver<double>(reference_variant, scene.model);
    RandomModel<double> rm(scene.model);
    CompositeInertia<double> composite(scene.model);
    const int verified = nv <= 100 ? 5 : 1;
    for (int i = 0; i < verified; ++i) {
      a.emplace_back(nv);
      M.emplace_back(nv, nv);
      X.emplace_back(nv, nv);
      set_position(scene.model, states[i].q, rm);
      mass_matrix(scene.model, rm, composite, Eigen::Ref<MatrixX<double>>(M.back()));
      Outcome outcome = solver->acceleration(states[i].q, states[i].qd, states[i].tau, a.back());
      if (outcome) outcome = solver->inverse(states[i].q, X.back());
      if (!outcome) {
        flaw = std::string(reference_variant) + ": " + describe(scene, outcome);
        return;
      }
      condition.push_back(scaled_condition_bound(M.back(), X.back()));
    }
  }

  template <class T>
  double bound(int i) const {
    return 1000.0 * scene.model.nv() * static_cast<double>(unit_roundoff<T>()) * condition[i];
  }
};

// "" where the error is within the bound.
std::string judge(double error, double bound) {
  if (error <= bound) return "";
  char text[80];
  std::snprintf(text, sizeof text, "wrong: error %.2g, bound %.2g", error, bound);
  return text;
}

template <class T>
std::string verify_acceleration(const Case& c, Solver<T>& solver, const Pool<T>& pool) {
  if (!c.flaw.empty()) return c.flaw;
  for (std::size_t i = 0; i < c.a.size(); ++i) {
    VectorX<T> a = VectorX<T>::Constant(c.scene.model.nv(), std::numeric_limits<T>::quiet_NaN());
    const Outcome outcome = solver.acceleration(pool.q[i], pool.qd[i], pool.tau[i], a);
    if (!outcome) return describe(c.scene, outcome);
    const double error = (a.template cast<double>() - c.a[i]).norm() / c.a[i].norm();
    if (const std::string flaw = judge(error, c.bound<T>(i)); !flaw.empty()) return flaw;
  }
  return "";
}

template <class T>
std::string verify_inverse(const Case& c, Solver<T>& solver, const Pool<T>& pool) {
  if (!c.flaw.empty()) return c.flaw;
  const int nv = c.scene.model.nv();
  for (std::size_t i = 0; i < c.X.size(); ++i) {
    MatrixX<T> X = MatrixX<T>::Constant(nv, nv, std::numeric_limits<T>::quiet_NaN());
    const Outcome outcome = solver.inverse(pool.q[i], X);
    if (!outcome) return describe(c.scene, outcome);
    const double error = (X.template cast<double>() - c.X[i]).norm() / c.X[i].norm();
    if (const std::string flaw = judge(error, c.bound<T>(i)); !flaw.empty()) return flaw;
  }
  return "";
}

template <class T>
std::string benchmark_name(const char* task, const std::string& variant, const Case& c) {
  return std::string(task) + "/" + variant + "/" + c.scene.name +
         (std::is_same_v<T, float> ? "/float32" : "/float64");
}

// Registers `call(i)`, the work on state i of the pool, to be verified once and then timed.
template <class Verify, class Call>
void add_benchmark(const std::string& name, std::size_t states, Verify verify, Call call) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& run) {
    if (const std::string flaw = verify(); !flaw.empty()) {
      run.SkipWithError(flaw.c_str());
      return;
    }
    std::size_t i = 0;
    for (auto _ : run) {
      call(i);
      if (++i == states) i = 0;
    }
  })->Unit(benchmark::kNanosecond);
}

template <class T>
void add_solver(const std::string& name, std::shared_ptr<Solver<T>> solver,
                std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool) {
  const int nv = c->scene.model.nv();
  auto a = std::make_shared<VectorX<T>>(nv);
  auto X = std::make_shared<MatrixX<T>>(nv, nv);
  add_benchmark(
      benchmark_name<T>("acceleration", name, *c), pool->q.size(),
      [=] { return verify_acceleration(*c, *solver, *pool); },
      [=](std::size_t i) {
        benchmark::DoNotOptimize(solver->acceleration(pool->q[i], pool->qd[i], pool->tau[i], *a));
        benchmark::DoNotOptimize(a->data());
      });
  add_benchmark(
      benchmark_name<T>("inverse", name, *c), pool->q.size(),
      [=] { return verify_inverse(*c, *solver, *pool); },
      [=](std::size_t i) {
        benchmark::DoNotOptimize(solver->inverse(pool->q[i], *X));
        benchmark::DoNotOptimize(X->data());
      });
}

// M by composite inertias, which every batch variant starts from.
template <class T>
void add_mass(std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool) {
  struct Work {
    Model<T> model;
    RandomModel<T> rm;
    CompositeInertia<T> composite;
    MatrixX<T> M;

    explicit Work(const Model<double>& m)
        : model(m.cast<T>()), rm(model), composite(model), M(m.nv(), m.nv()) {}
    void mass(const VectorX<T>& q) {
      set_position(model, q, rm);
      mass_matrix(model, rm, composite, Eigen::Ref<MatrixX<T>>(M));
    }
  };
  auto work = std::make_shared<Work>(c->scene.model);
  add_benchmark(
      benchmark_name<T>("mass", "CRBA", *c), pool->q.size(),
      [=] {
        work->mass(pool->q[0]);
        return judge((work->M.template cast<double>() - c->M[0]).norm() / c->M[0].norm(),
                     c->bound<T>(0));
      },
      [=](std::size_t i) {
        work->mass(pool->q[i]);
        benchmark::DoNotOptimize(work->M.data());
      });
}

void add_mujoco(std::shared_ptr<const Case> c, std::shared_ptr<const Pool<double>> pool) {
  auto solver = std::make_shared<MujocoSolver>(mujoco_of(c->scene));
  add_solver<double>("MuJoCo", solver, c, pool);
  auto M = std::make_shared<MatrixX<double>>(c->scene.model.nv(), c->scene.model.nv());
  add_benchmark(
      benchmark_name<double>("mass", "MuJoCo", *c), pool->q.size(),
      [=] {
        solver->mass(pool->q[0], *M);
        return judge((*M - c->M[0]).norm() / c->M[0].norm(), c->bound<double>(0));
      },
      [=](std::size_t i) {
        solver->mass(pool->q[i], *M);
        benchmark::DoNotOptimize(M->data());
      });
}

template <class T>
void add_variants(std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool,
                  bool exhibits) {
  const Model<T> model = c->scene.model.cast<T>();
  for (const RegisteredVariant<T>& variant : registered_variants<T>())
    if (variant.contender || exhibits)
      add_solver<T>(variant.name, std::shared_ptr<Solver<T>>(variant.make(model)), c, pool);
  add_mass<T>(c, pool);
}

int run(const std::vector<std::string>& scenes, std::uint64_t seed, bool exhibits) {
  for (const std::string& what : scenes) {
    auto c = std::make_shared<const Case>(what, seed);
    auto float64 = std::make_shared<const Pool<double>>(c->states);
    auto float32 = std::make_shared<const Pool<float>>(c->states);
    add_variants<double>(c, float64, exhibits);
    add_variants<float>(c, float32, exhibits);
    add_mujoco(c, float64);
  }
  // What the harness itself costs a call: its loop is compiled here, whatever build of the library
  // is linked.
  add_benchmark(
      "harness/empty/none/none", 1000, [] { return std::string(); },
      [](std::size_t i) { benchmark::DoNotOptimize(i); });
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
        "Usage: bench_inverse SCENE... [--seed S] [--exhibits] [flags of Google Benchmark]\n\n  "
        "SCENE: %s\n\n",
        scene_help);
    benchmark::PrintDefaultHelp();
  });
  CLI::App app("Time of forward dynamics, M^-1 and M for every variant.", "bench_inverse");
  std::vector<std::string> scenes;
  std::uint64_t seed = 1;
  app.add_option("SCENE", scenes, scene_help)->required();
  app.add_option("--seed", seed, "of the random states")->capture_default_str();
  bool exhibits = false;
  app.add_flag("--exhibits", exhibits, "the accuracy laboratory's variants too");
  return run_program(app, argc, argv, [&] { return run(scenes, seed, exhibits); });
}
