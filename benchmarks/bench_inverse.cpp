// bench_inverse: time of forward dynamics, of M^-1 and of M, for every variant, precision and
// scene.
//
// Names are task/variant/scene/precision. With --generated there is code for the one robot, too, of one state, and as
// acceleration_batch and inverse_batch of rows of 1024; each is compiled when it is first timed. Every variant is verified on a few states before it is
// timed, against the float64 square-root filter: a failed or wrong result is reported as an error
// and is not timed. The verification's bound is there to catch what is wrong, not what is inexact;
// the accuracy programs judge that.
#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/study/solver.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "benchmarks/generated_code.hpp"
#include "robots/scene/mujoco_solver.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to the result: kinematics, velocity and bias terms, gravity, factorisation "
    "and solution, in "
    "one call, memory taken before. inverse and mass take q alone and write both triangles. Each "
    "call takes the next of "
    "a pool of random states. A batch goes from row-major arrays of 1024 states to such an array. "
    "Code for one robot does not "
    "test for singularity.";

template <class T>
std::string verify_acceleration(const Case& c, Solver<T>& solver, const Pool<T>& pool) {
  if (!c.flaw.empty()) return c.flaw;
  for (int i = 0; i < c.verified(); ++i) {
    VectorX<T> a = VectorX<T>::Constant(c.scene.model.nv(), std::numeric_limits<T>::quiet_NaN());
    const Outcome outcome = solver.acceleration(pool.q[i], pool.qd[i], pool.tau[i], a);
    const std::string flaw = outcome ? c.judge(i, a) : describe(c.scene, outcome);
    if (!flaw.empty()) return flaw;
  }
  return "";
}

template <class T>
std::string verify_inverse(const Case& c, Solver<T>& solver, const Pool<T>& pool) {
  if (!c.flaw.empty()) return c.flaw;
  const int nv = c.scene.model.nv();
  for (int i = 0; i < c.verified(); ++i) {
    MatrixX<T> X = MatrixX<T>::Constant(nv, nv, std::numeric_limits<T>::quiet_NaN());
    const Outcome outcome = solver.inverse(pool.q[i], X);
    const std::string flaw =
        outcome ? c.compare<T>(c.X[i], X, c.condition[i]) : describe(c.scene, outcome);
    if (!flaw.empty()) return flaw;
  }
  return "";
}

template <class T>
std::string verify_mass(const Case& c, Solver<T>& solver, const Pool<T>& pool) {
  const int nv = c.scene.model.nv();
  MatrixX<T> M = MatrixX<T>::Constant(nv, nv, std::numeric_limits<T>::quiet_NaN());
  solver.mass(pool.q[0], M);
  return c.compare<T>(c.M[0], M, 1);
}

// What it gives of acceleration, inverse and mass.
template <class T>
void add_solver(const std::string& name, const VariantTraits& traits,
                std::shared_ptr<Solver<T>> solver, std::shared_ptr<const Case> c,
                std::shared_ptr<const Pool<T>> pool) {
  const int nv = c->scene.model.nv();
  auto a = std::make_shared<VectorX<T>>(nv);
  auto X = std::make_shared<MatrixX<T>>(nv, nv);
  if (traits.gives(Want::acceleration))
    add_benchmark(
        name_of<T>("acceleration", name, *c),
        [=] { return verify_acceleration(*c, *solver, *pool); },
        [=](int i) {
          benchmark::DoNotOptimize(solver->acceleration(pool->q[i], pool->qd[i], pool->tau[i], *a));
          benchmark::DoNotOptimize(a->data());
        });
  if (traits.gives(Want::inverse))
    add_benchmark(
        name_of<T>("inverse", name, *c), [=] { return verify_inverse(*c, *solver, *pool); },
        [=](int i) {
          benchmark::DoNotOptimize(solver->inverse(pool->q[i], *X));
          benchmark::DoNotOptimize(X->data());
        });
  if (traits.gives(Want::mass))
    add_benchmark(
        name_of<T>("mass", name, *c), [=] { return verify_mass(*c, *solver, *pool); },
        [=](int i) {
          solver->mass(pool->q[i], *X);
          benchmark::DoNotOptimize(X->data());
        });
}

// A task of a generated variant, of one state and of all; call(code, pool, i, out), call_rows(code, pool, out) and judge(i, out).
template <class T, class Call, class CallRows, class Judge>
void add_code(const std::string& task, const GeneratedVariant& variant, GeneratedTask generated,
              std::ptrdiff_t width, std::shared_ptr<const Case> c,
              std::shared_ptr<const Pool<T>> pool, const Call& call, const CallRows& call_rows,
              const Judge& judge) {
  const auto code = std::make_shared<std::unique_ptr<const GeneratedCode<T>>>();
  const auto add = [&](const std::string& name, int states, const auto& answer) {
    benchmark::RegisterBenchmark(name_of<T>(name, variant.name, *c).c_str(), [=](benchmark::State&
                                                                                     run) {
      std::vector<T> out(states * width, std::numeric_limits<T>::quiet_NaN());
      std::string flaw = c->flaw;
      const int nv = c->scene.model.nv();
      if (nv > most_recorded_dofs)
        flaw = "code is recorded of at most " + std::to_string(most_recorded_dofs) +
               " degrees of freedom, of which it has " + std::to_string(nv);
      try {
        if (!*code && flaw.empty())
          *code = std::make_unique<const GeneratedCode<T>>(variant, generated,
                                                           c->scene.model.cast<T>());
        for (int i = 0; i < c->verified() && flaw.empty(); ++i) {
          answer(**code, i, out.data());
          flaw = judge(i, &out[states > 1 ? i * width : 0]);
        }
      } catch (const std::exception& e) {
        flaw = e.what();
      }
      if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
      time_calls(run, [&](int i) {
        answer(**code, i, out.data());
        benchmark::DoNotOptimize(out.data());
      });
      count(run, (*code)->flops(), states);
    })->Unit(benchmark::kNanosecond);
  };
  add(task, 1, [=](const GeneratedCode<T>& of, int i, T* out) { call(of, *pool, i, out); });
  add(task + "_batch", batch_size,
      [=](const GeneratedCode<T>& of, int, T* out) { call_rows(of, *pool, out); });
}

template <class T>
void add_generated(std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool) {
  const int nv = c->scene.model.nv();
  using Code = GeneratedCode<T>;
  using States = Pool<T>;
  for (const GeneratedVariant& variant : generated_variants()) {
    add_code<T>(
        "acceleration", variant, GeneratedTask::forward_dynamics, nv, c, pool,
        [](const Code& code, const States& at, int i, T* a) {
          code.acceleration(at.q[i].data(), at.qd[i].data(), at.tau[i].data(), a);
        },
        [](const Code& code, const States& at, T* a) {
          code.acceleration(batch_size, at.q_rows.data(), at.qd_rows.data(), at.tau_rows.data(), a);
        },
        [=](int i, const T* a) { return c->judge<T>(i, Eigen::Map<const VectorX<T>>(a, nv)); });
    add_code<T>(
        "inverse", variant, GeneratedTask::inverse_mass, std::ptrdiff_t(nv) * nv, c, pool,
        [](const Code& code, const States& at, int i, T* X) { code.inverse(at.q[i].data(), X); },
        [](const Code& code, const States& at, T* X) {
          code.inverse(batch_size, at.q_rows.data(), X);
        },
        [=](int i, const T* X) {
          return c->compare<T>(c->X[i], Eigen::Map<const MatrixX<T>>(X, nv, nv), c->condition[i]);
        });
  }
}

// Which of the exhibits are timed too.
struct Also {
  bool exhibits = false, ladder = false, generated = false;

  bool times(const VariantTraits& traits) const {
    return exhibits || (ladder && is_of_ladder(traits.kind));
  }
};

template <class T>
void add_variants(std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool,
                  const Also& also) {
  const Model<T> model = c->scene.model.cast<T>();
  for (const RegisteredVariant<T>& variant : registered_variants<T>(Want::mass))
    if (!variant.traits.gives(Want::inverse))
      add_solver<T>(variant.name, variant.traits, variant.make(model), c, pool);
  for (const RegisteredVariant<T>& variant : registered_variants<T>())
    if (variant.traits.contender || (also.times(variant.traits) && variant.takes(model)))
      add_solver<T>(variant.name, variant.traits, variant.make(model), c, pool);
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed, const Also& also) {
  for (const Scene& scene : scenes) {
    auto c = std::make_shared<const Case>(scene, seed);
    auto float64 = std::make_shared<const Pool<double>>(c->states);
    auto float32 = std::make_shared<const Pool<float>>(c->states);
    add_variants<double>(c, float64, also);
    add_variants<float>(c, float32, also);
    if (also.generated) {
      add_generated<double>(c, float64);
      add_generated<float>(c, float32);
    }
    add_solver<double>("MuJoCo", mujoco_traits(),
                       std::make_shared<MujocoSolver>(mujoco_of(c->scene)), c, float64);
  }
  // What the harness itself costs a call: its loop is compiled here, whatever build of the library
  // is linked.
  add_benchmark(
      "harness/empty/none/none", [] { return std::string(); },
      [](int i) { benchmark::DoNotOptimize(i); });
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  Also also;
  return Driver{"bench_inverse", "Time of forward dynamics, M^-1 and M for every variant.",
                timed_call, "[--exhibits] [--ladder] [--generated] "}
      .run(
          argc, argv,
          [&](const std::vector<Scene>& scenes, std::uint64_t seed) {
            add_scenes(scenes, seed, also);
          },
          [&](CLI::App& app) {
            app.add_flag("--exhibits", also.exhibits, "the accuracy laboratory's variants too");
            app.add_flag("--ladder", also.ladder, "of these the ladder's tolerances and rungs");
            app.add_flag("--generated", also.generated,
                         "code for the robot by the study's variants, compiled");
          });
}
