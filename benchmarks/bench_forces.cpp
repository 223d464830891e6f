// bench_forces: what forces from outside on two bodies, or loads there, add to the time of forward dynamics, of one
// state and of 1024 in one call.
//
// Names are task/given/scene/precision; tasks are acceleration and acceleration_batch, given is `none`, the axes that
// forces are given in, or `loads`. They act on the last two links that end in no other, or on the
// last and the middle one. Everything is verified before it is timed (case.hpp).
#include <benchmark/benchmark.h>

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/kinematics.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd, tau and what is given to the acceleration. Memory is taken before. One state: "
    "each "
    "call takes the "
    "next of a pool.";

constexpr int forces_of_state = 12, loads_of_state = 20;

std::vector<Frame> two_frames(const RobotModel& robot) {
  std::vector<char> is_tip(robot.nv(), 1);
  for (const LinkParameters& link : robot.links)
    if (link.parent >= 0) is_tip[link.parent] = 0;
  std::vector<Frame> out;
  for (int k = robot.nv() - 1; k >= 0 && out.size() < 2; --k)
    if (is_tip[k]) out.push_back({k, {1, 0.1, 0, 0}, {0, 0.1, 0}});
  int middle = robot.nv() / 2;
  while (middle + 1 < robot.nv() && robot.links[middle + 1].coordinate == Coordinate::follower)
    ++middle;
  if (out.size() < 2) out.push_back({middle, {1, 0, 0.2, 0}, {0.1, 0, 0}});
  return out;
}

// 1 N and 1 N m, by turns.
template <class T>
std::vector<T> forces_of_rows(int rows) {
  std::vector<T> out(rows * forces_of_state);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<T>(i % 3 == 0 ? 1 : -0.5);
  return out;
}

// 1 kg with radii of 0.1 m, 0.1 m from the frame.
template <class T>
std::vector<T> loads_of_rows(int rows) {
  std::vector<T> out;
  for (int i = 0; i < 2 * rows; ++i)
    for (const double x : {1.0, 0.0, 0.0, 0.1, 0.03, 0.03, 0.02, 0.0, 0.0, 0.0})
      out.push_back(static_cast<T>(x));
  return out;
}

// What a call is given beside the state; neither: nothing.
struct Given {
  std::optional<Axes> in = {};  // forces in these axes
  bool loads = false;
};

// a of state i: the case's own, with the forces and M^-1 J' f, with loads to the last bits.
VectorX<double> accelerated(const Case& c, const std::vector<Frame>& frames, const Given& given,
                            int i) {
  if (given.loads) {
    Dynamics<double> robot(
        plain(c.scene.model),
        {.tolerance = last_bits, .question = {.want = {Want::acceleration}, .loaded = frames}});
    const std::vector<double> loads = loads_of_rows<double>(1);
    VectorX<double> a(c.scene.model.nv());
    const State& state = c.states[i];
    if (!robot.forward_dynamics(state.q, state.qd, state.tau, a,
                                {.loads = VectorView<const double>(loads)}))
      a.setConstant(std::numeric_limits<double>::quiet_NaN());
    return a;
  }
  if (!given.in) return c.a[i];
  const int nv = c.scene.model.nv();
  MatrixX<double> Jt(nv, forces_of_state);
  Kinematics<double> kinematics(plain(c.scene.model), frames);
  kinematics.compute(c.states[i].q, {.axes = *given.in, .jacobians = Jt});
  const std::vector<double> f = forces_of_rows<double>(batch_size);
  const Eigen::Map<const VectorX<double>> own(&f[i * forces_of_state], forces_of_state);
  return c.a[i] + c.X[i] * (Jt * own);
}

template <class T>
void add(std::shared_ptr<const Case> c, const std::string& name, const Given& given) {
  const RobotModel model = plain(c->scene.model);
  const std::vector<Frame> frames = two_frames(model);
  DynamicsOptions options{.question = {.want = {Want::acceleration}}};
  if (given.in) options.question.acted_on = frames;
  if (given.loads) options.question.loaded = frames;
  const auto robot = std::make_shared<Dynamics<T>>(model, options);
  const auto pool = std::make_shared<const Pool<T>>(c->states);
  const auto f = std::make_shared<const std::vector<T>>(forces_of_rows<T>(batch_size));
  const auto loads = std::make_shared<const std::vector<T>>(loads_of_rows<T>(batch_size));
  const int nv = model.nv();

  const auto judge = [=](int i, const T* a) {
    const VectorX<T> x = Eigen::Map<const VectorX<T>>(a, nv);
    return c->template compare<T>(accelerated(*c, frames, given, i), x, c->condition[i]);
  };
  const auto a = std::make_shared<VectorX<T>>(nv);
  const auto one = [=](int i) {
    StateForces<T> forces;
    if (given.in)
      forces = {VectorView<const T>(f->data() + i * forces_of_state, forces_of_state), *given.in};
    if (given.loads) forces.loads = VectorView<const T>(loads->data(), loads_of_state);
    return robot->forward_dynamics(pool->q[i], pool->qd[i], pool->tau[i], *a, forces);
  };
  add_benchmark(
      name_of<T>("acceleration", name, *c),
      [=] { return flaw_of(*c, one, [&](int i) { return judge(i, a->data()); }); },
      [=](int i) {
        benchmark::DoNotOptimize(one(i));
        benchmark::DoNotOptimize(a->data());
      });

  benchmark::RegisterBenchmark(
      name_of<T>("acceleration_batch", name, *c).c_str(),
      [=](benchmark::State& run) {
        std::vector<T> rows(std::size_t(batch_size) * nv, std::numeric_limits<T>::quiet_NaN());
        std::vector<Outcome> outcomes(batch_size);
        ForceRows<T> forces;
        if (given.in)
          forces = {RowsView<const T>(f->data(), batch_size, forces_of_state), *given.in};
        if (given.loads)
          forces.loads = RowsView<const T>(loads->data(), batch_size, loads_of_state);
        const auto call = [&] {
          return robot->forward_dynamics(pool->q_rows, pool->qd_rows, pool->tau_rows, rows,
                                         outcomes, 1, forces);
        };
        std::string flaw = c->flaw;
        if (const int failed = call(); failed > 0) flaw = std::to_string(failed) + " states failed";
        for (int i = 0; i < c->verified() && flaw.empty(); ++i) flaw = judge(i, &rows[i * nv]);
        if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
        for (auto _ : run) {
          benchmark::DoNotOptimize(call());
          benchmark::DoNotOptimize(rows.data());
        }
        count(run, 0, batch_size);
      })
      ->Unit(benchmark::kMicrosecond);
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  add<T>(c, "none", {});
  add<T>(c, "local", {Axes::local});
  add<T>(c, "aligned", {Axes::aligned});
  add<T>(c, "world", {Axes::world});
  add<T>(c, "loads", {.loads = true});
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
  return Driver{"bench_forces",
                "Time of forward dynamics with forces from outside, and with loads.", timed_call}
      .run(argc, argv, add_scenes);
}
