// bench_step: time of an implicit step (kalmarm/implicit_step.hpp) against forward dynamics of the same
// robot, one state and rows of 1024 on one core, and against mj_step of MuJoCo without contacts.
//
// Every hinge and slide has a spring of 1e5 N m/rad and a damper of 10 N m s/rad, and h is 2 ms;
// --damp-all: the DoF of ball and free joints have dampers too.
// Names are task/variant/scene/precision; tasks: acceleration and acceleration_batch (no terms), step and
// step_batch, gains_batch (every state with dampers and springs of its own, which are the step's),
// coupled and coupled_batch (with rows, --rows of them, each a spring and a damper between two joints),
// mj_step, and mj_forward, which is what mj_step does before it integrates. Everything is
// verified before it is timed: M^ a against M a0 - B v - K (q + h v) less the forces of rows, with M and
// the a0 of forward dynamics from case.hpp.
#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/scene/mujoco_step.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to the acceleration of the step or of forward dynamics; of mj_step to the "
    "next "
    "state. Memory is taken before. Each call takes the next of a pool of random states.";

constexpr double h = 0.002, stiffness = 1e5, damping = 10;

JointTerms terms_of(const RobotModel& robot, bool damps_all) {
  JointTerms out;
  for (const LinkParameters& link : robot.links) {
    const bool single = takes_spring(link);
    out.damping.push_back(single || damps_all ? damping : 0);
    out.stiffness.push_back(single ? stiffness : 0);
  }
  return out;
}

// So many, over the pairs of hinges and slides that follow one another, and over those again.
std::vector<CoupledRow> coupled_rows(const RobotModel& robot, int count) {
  std::vector<int> single;
  for (int k = 0; k < robot.nv(); ++k)
    if (takes_spring(robot.links[k])) single.push_back(k);
  std::vector<CoupledRow> out;
  const int pairs = static_cast<int>(single.size()) - 1;
  for (int i = 0; i < count && pairs > 0; ++i) {
    CoupledRow row = {.damping = damping, .stiffness = stiffness};
    row.jacobian.assign(robot.nv(), 0);
    row.jacobian[single[i % pairs]] = 1;
    row.jacobian[single[i % pairs + 1]] = -0.5 - i / pairs;
    out.push_back(row);
  }
  return out;
}

// A scene, and what its implicit steps are for the states that are verified.
struct Steps {
  Case base;
  RobotModel robot;
  JointTerms terms, coupled;                                 // without rows, and with them
  std::vector<VectorX<double>> at_end, at_start, with_rows;  // a by where springs are

  Steps(const Scene& scene, std::uint64_t seed, bool damps_all, int rows)
      : base(scene, seed),
        robot(plain(scene.model)),
        terms(terms_of(robot, damps_all)),
        coupled(terms) {
    coupled.rows = coupled_rows(robot, rows);
    const int nv = robot.nv();
    for (int i = 0; i < base.verified(); ++i) {
      const State& state = base.states[i];
      const auto solved = [&](double h_of_springs, const std::vector<CoupledRow>& rows = {}) {
        MatrixX<double> M = base.M[i];
        VectorX<double> right = M * base.a[i];
        for (int k = 0; k < nv; ++k) {
          const double b = terms.damping[k], s = terms.stiffness[k];
          M(k, k) += h * (b + h_of_springs * s);
          right[k] -= b * state.qd[k];
          if (s > 0) right[k] -= s * (state.q[robot.links[k].q_index] + h_of_springs * state.qd[k]);
        }
        for (const CoupledRow& row : rows) {
          const Eigen::Map<const VectorX<double>> J(row.jacobian.data(), nv);
          double length = 0;
          for (int k = 0; k < nv; ++k)
            if (J[k] != 0) length += J[k] * state.q[robot.links[k].q_index];
          const double rate = J.dot(state.qd);
          right -= J * (row.damping * rate + row.stiffness * (length + h_of_springs * rate));
          M += J * (h * (row.damping + h_of_springs * row.stiffness)) * J.transpose();
        }
        return VectorX<double>(M.ldlt().solve(right));
      };
      at_end.push_back(solved(h));
      at_start.push_back(solved(0));
      with_rows.push_back(solved(h, coupled.rows));
    }
  }

  // "" where a of state i is near enough.
  template <class T, class A>
  std::string judge(int i, const A& right, const VectorX<T>& a) const {
    return base.flaw.empty() ? base.compare<T>(right[i], a, base.condition[i]) : base.flaw;
  }
};

template <class T>
using Shared = std::shared_ptr<const T>;

// call(i, a): of one state. right: what is expected.
template <class T, class Call>
void add_one(const std::string& task, const std::string& variant, const Shared<Steps>& steps,
             const std::vector<VectorX<double>>& right, Call call) {
  auto a = std::make_shared<VectorX<T>>(steps->robot.nv());
  add_benchmark(
      name_of<T>(task, variant, steps->base),
      [=] {
        std::string flaw;
        for (int i = 0; i < steps->base.verified() && flaw.empty(); ++i) {
          a->setConstant(std::numeric_limits<T>::quiet_NaN());
          const Outcome outcome = call(i, *a);
          flaw = outcome ? steps->judge<T>(i, right, *a) : describe(steps->base.scene, outcome);
        }
        return flaw;
      },
      [=](int i) {
        benchmark::DoNotOptimize(call(i, *a));
        benchmark::DoNotOptimize(a->data());
      });
}

// call(a, outcomes): of all rows; how many failed.
template <class T, class Call>
void add_rows(const std::string& task, const std::string& variant, const Shared<Steps>& steps,
              const std::vector<VectorX<double>>& right, Call call) {
  benchmark::RegisterBenchmark(
      name_of<T>(task, variant, steps->base).c_str(),
      [=](benchmark::State& run) {
        const int nv = steps->robot.nv();
        std::vector<T> a(batch_size * nv, std::numeric_limits<T>::quiet_NaN());
        std::vector<Outcome> outcomes(batch_size);
        const int failed = call(a, outcomes);
        std::string flaw = failed > 0 ? std::to_string(failed) + " states failed" : "";
        for (int i = 0; i < steps->base.verified() && flaw.empty(); ++i)
          flaw = steps->judge<T>(i, right, VectorX<T>(Eigen::Map<VectorX<T>>(&a[i * nv], nv)));
        if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
        for (auto _ : run) {
          benchmark::DoNotOptimize(call(a, outcomes));
          benchmark::DoNotOptimize(a.data());
        }
        count(run, 0, batch_size);
      })
      ->Unit(benchmark::kMicrosecond)
      ->UseRealTime();
}

// The step's own, of every row.
template <class T>
struct Gains {
  std::vector<T> damping, stiffness;

  explicit Gains(const JointTerms& terms) {
    for (int i = 0; i < batch_size; ++i) {
      damping.insert(damping.end(), terms.damping.begin(), terms.damping.end());
      stiffness.insert(stiffness.end(), terms.stiffness.begin(), terms.stiffness.end());
    }
  }
};

template <class T>
void add_fast(const Shared<Steps>& steps) {
  const auto pool = std::make_shared<const Pool<T>>(steps->base.states);
  for (const RegisteredVariant<T>& variant : ladder_variants<T>()) {
    if (!variant.traits.contender) continue;
    const DynamicsOptions options = {.tolerance = variant.traits.tolerance,
                                     .question = {.want = {Want::acceleration}}};
    const auto robot = std::make_shared<Dynamics<T>>(steps->robot, options);
    const auto step = std::make_shared<ImplicitStep<T>>(steps->robot, h, steps->terms,
                                                        Scheme::springs_at_end, options);
    add_one<T>("acceleration", variant.name, steps, steps->base.a, [=](int i, VectorX<T>& a) {
      return robot->forward_dynamics(pool->q[i], pool->qd[i], pool->tau[i], a);
    });
    add_one<T>("step", variant.name, steps, steps->at_end, [=](int i, VectorX<T>& a) {
      return step->acceleration(pool->q[i], pool->qd[i], pool->tau[i], a);
    });
    add_rows<T>("acceleration_batch", variant.name, steps, steps->base.a,
                [=](std::vector<T>& a, std::vector<Outcome>& outcomes) {
                  return robot->forward_dynamics(pool->q_rows, pool->qd_rows, pool->tau_rows, a,
                                                 outcomes);
                });
    add_rows<T>("step_batch", variant.name, steps, steps->at_end,
                [=](std::vector<T>& a, std::vector<Outcome>& outcomes) {
                  return step->acceleration(pool->q_rows, pool->qd_rows, pool->tau_rows, a,
                                            outcomes);
                });
    if (!variant.traits.refined) {
      const auto gains = std::make_shared<const Gains<T>>(steps->terms);
      add_rows<T>("gains_batch", variant.name, steps, steps->at_end,
                  [=](std::vector<T>& a, std::vector<Outcome>& outcomes) {
                    return step->acceleration(
                        pool->q_rows, pool->qd_rows, pool->tau_rows,
                        {.damping = gains->damping, .stiffness = gains->stiffness}, a, outcomes);
                  });
    }
    if (steps->coupled.rows.empty()) continue;
    const auto coupled = std::make_shared<ImplicitStep<T>>(steps->robot, h, steps->coupled,
                                                           Scheme::springs_at_end, options);
    add_one<T>("coupled", variant.name, steps, steps->with_rows, [=](int i, VectorX<T>& a) {
      return coupled->acceleration(pool->q[i], pool->qd[i], pool->tau[i], a);
    });
    add_rows<T>("coupled_batch", variant.name, steps, steps->with_rows,
                [=](std::vector<T>& a, std::vector<Outcome>& outcomes) {
                  return coupled->acceleration(pool->q_rows, pool->qd_rows, pool->tau_rows, a,
                                               outcomes);
                });
  }
}

void add_mujoco(const Shared<Steps>& steps) {
  const auto model = mujoco_of(steps->base.scene);
  const std::pair<mjtIntegrator, const char*> integrators[] = {
      {mjINT_IMPLICITFAST, "MuJoCo implicitfast"}, {mjINT_DISCRETE, "MuJoCo discrete"}};
  for (const auto& [integrator, name] : integrators) {
    const auto mujoco = std::make_shared<MujocoStep>(*model, h, steps->terms, integrator);
    const auto& right = integrator == mjINT_DISCRETE ? steps->at_end : steps->at_start;
    add_one<double>("mj_step", name, steps, right, [=](int i, VectorX<double>& a) {
      const State& state = steps->base.states[i];
      mujoco->step(state.q, state.qd, state.tau);
      a = (mujoco->v() - state.qd) / h;
      return Outcome{};
    });
  }
  const auto mujoco = std::make_shared<MujocoStep>(*model, h, steps->terms, mjINT_IMPLICITFAST);
  add_benchmark(
      name_of<double>("mj_forward", "MuJoCo", steps->base), [=] { return steps->base.flaw; },
      [=](int i) {
        const State& state = steps->base.states[i];
        mujoco->forward(state.q, state.qd, state.tau);
        benchmark::DoNotOptimize(mujoco->v().data());
      });
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed, bool damps_all, int rows) {
  for (const Scene& scene : scenes) {
    const auto steps = std::make_shared<const Steps>(scene, seed, damps_all, rows);
    add_fast<double>(steps);
    add_fast<float>(steps);
    add_mujoco(steps);
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  bool damps_all = false;
  int rows = 6;
  Driver driver{"bench_step", "Time of implicit steps with springs and dampers.", timed_call,
                "[--damp-all] [--rows N] "};
  return driver.run(
      argc, argv,
      [&](const std::vector<Scene>& scenes, std::uint64_t seed) {
        add_scenes(scenes, seed, damps_all, rows);
      },
      [&](CLI::App& app) {
        app.add_flag("--damp-all", damps_all, "dampers of ball and free joints too");
        app.add_option("--rows", rows, "rows that couple two joints each")
            ->check(CLI::Range(0, 64))
            ->capture_default_str();
      });
}
