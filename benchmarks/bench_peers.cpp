// bench_peers: the fast path against other libraries, and against itself built by another compiler,
// on the same mechanisms in the same states in one run.
//
// Names are task/variant/scene/precision; tasks are acceleration, inverse_dynamics, inverse, mass,
// derivatives, frame, momentum, operational and regressor, of all TASK_batch, and of matrices TASK_triangle. Everything is verified before it is
// timed: results against the float64 square-root filter, torques against Newton and Euler in link
// frames, derivatives against differences of the filter; what is wrong is reported as an error and is
// not timed. A library without armature solves the mechanism without. Counters: as in case.hpp,
// allocations of a call, and generate_s, the CPU seconds that generating and compiling code for the
// mechanism took, now or when it was first done. `bytes` of a state are what a call must move at
// least: what it is given, read once, and its result, written once. The model and memory for what lies between stay in
// a cache at best and are not counted; nor are a batch's results that the next state overwrites, so
// that a batch which is a loop has no `bytes`. The machine's limits: peak/fma (peak.hpp) and
// bandwidth/copy@1 (bandwidth.hpp). For medians that other programs on the machine disturb least
// add
//   --benchmark_repetitions=9 --benchmark_enable_random_interleaving=true
#include <benchmark/benchmark.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/test/allocations.hpp"
#include "benchmarks/bandwidth.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/derivative_check.hpp"
#include "benchmarks/driver.hpp"
#include "benchmarks/kinematics_check.hpp"
#include "benchmarks/peak.hpp"
#include "benchmarks/peers/mechanism.hpp"
#include "benchmarks/peers/modules.hpp"
#include "benchmarks/peers/peer.hpp"
#include "robots/scene/mujoco_solver.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau (inverse, mass, frame, momentum, operational: q; inverse_dynamics "
    "and regressor: tau's numbers as qdd) in the library's own conventions to the result in its "
    "own memory: kinematics, velocity terms and gravity included, conversions of states and "
    "results not. Matrices have both triangles, TASK_triangle the one that a library fills. "
    "TASK_batch: 1024 states on one core; ours in one "
    "call from row-major arrays to row-major arrays, the others state after state.";

// What stands behind the Solver interface already: MuJoCo, and a variant of the registry.
template <class S>
class SolverPeer final : public Peer {
 public:
  SolverPeer(std::string name, std::string version, std::unique_ptr<S> solver, int nq, int nv)
      : name_(std::move(name)),
        version_(std::move(version)),
        solver_(std::move(solver)),
        nq_(nq),
        a_(nv),
        torque_(nv),
        matrix_(nv, nv) {}

  std::string name() const override { return name_; }
  std::string version() const override { return version_; }
  bool can(Task task) const override {
    return is_common(task) && (has_mass || task != Task::mass) &&
           (has_inverse_dynamics || task != Task::inverse_dynamics);
  }
  void add_state(const double* q, const double* qd, const double* tau) override {
    const int nv = static_cast<int>(a_.size());
    const auto vector = [](const double* x, int n) -> VectorX<double> {
      return Eigen::Map<const VectorX<double>>(x, n);
    };
    states_.push_back({vector(q, nq_), vector(qd, nv), vector(tau, nv)});
  }

  bool acceleration(int i) override {
    return static_cast<bool>(
        solver_->acceleration(states_[i].q, states_[i].qd, states_[i].tau, a_));
  }
  bool inverse_dynamics(int i) override {
    const State& state = states_[i];
    if constexpr (has_inverse_dynamics)
      solver_->inverse_dynamics(state.q, state.qd, state.tau, torque_);
    return has_inverse_dynamics;
  }
  bool inverse(int i) override {
    return static_cast<bool>(solver_->inverse(states_[i].q, matrix_));
  }
  bool mass(int i) override {
    if constexpr (has_mass) solver_->mass(states_[i].q, matrix_);
    return has_mass;
  }
  void get_acceleration(int, double* a) const override { std::copy(a_.begin(), a_.end(), a); }
  void get_torque(int, double* tau) const override {
    std::copy(torque_.begin(), torque_.end(), tau);
  }
  void get_matrix(int, double* out) const override {
    std::copy_n(matrix_.data(), matrix_.size(), out);  // symmetric
  }

 private:
  static constexpr bool has_mass = requires(S & solver, VectorX<double> q, MatrixX<double> M) {
    solver.mass(q, M);
  };
  static constexpr bool has_inverse_dynamics = requires(S & solver, VectorX<double> x) {
    solver.inverse_dynamics(x, x, x, x);
  };

  int states() const override { return static_cast<int>(states_.size()); }

  std::string name_, version_;
  std::unique_ptr<S> solver_;
  int nq_;
  std::vector<State> states_;
  VectorX<double> a_, torque_;
  MatrixX<double> matrix_;
};

// A mechanism and all that can solve it. Peers refer to it: it stays where it is made.
struct Contest {
  Case truth, plain;  // plain: without armature
  Mechanism mechanism;
  std::unique_ptr<Solver<double>> reference;
  Peers peers;

  Contest(const Scene& scene, std::uint64_t seed, const std::vector<Module>& modules)
      : truth(scene, seed),
        plain(without_armature(scene), seed),
        mechanism(make_mechanism(truth.scene.model)),
        reference(make_solver<double>("Sequential<ArrayMGS>", truth.scene.model)) {
    for (const Module module : modules) module(mechanism, peers);
    add_solvers();
  }
  Contest(const Contest&) = delete;

  const Case& truth_of(const Peer& peer) const { return peer.has_armature() ? truth : plain; }

 private:
  void add_solvers() {
    const Model<double>& model = truth.scene.model;
    const auto add = [&](const char* name, std::string version, auto solver) {
      using S = typename decltype(solver)::element_type;
      peers.push_back(std::make_unique<SolverPeer<S>>(name, std::move(version), std::move(solver),
                                                      model.nq(), model.nv()));
    };
    add("Sequential<Conventional>", "", make_solver<double>("Sequential<Conventional>", model));
    add("MuJoCo", std::string("MuJoCo ") + mujoco_version() + " (its own build)",
        std::make_unique<MujocoSolver>(mujoco_of(truth.scene)));
  }
};

// "" where the peer's last result for state i is right.
template <class T>
std::string judge(const Contest& contest, const Peer& peer, Task task, int i) {
  const Case& truth = contest.truth_of(peer);
  const int nv = truth.scene.model.nv();
  const auto poisoned = [&] {
    using RowMajor = Eigen::Matrix<double, -1, -1, Eigen::RowMajor>;
    return RowMajor::Constant(nv, nv, std::numeric_limits<double>::quiet_NaN()).eval();
  };
  if (task == Task::derivatives) {
    auto dq = poisoned(), dqd = poisoned(), dtau = poisoned();
    peer.get_derivatives(i, dq.data(), dqd.data(), dtau.data());
    const double error =
        derivative_error(truth.scene.model, *contest.reference, truth.states[i], dq, dqd, dtau);
    const double bound = derivative_bound(truth.bound<T>(truth.condition[i]));
    return error <= bound ? "" : wrong(error, bound);
  }
  if (is_kinematics(task)) {
    using RowMajor = Eigen::Matrix<double, -1, -1, Eigen::RowMajor>;
    RowMajor columns = RowMajor::Constant(6, nv, std::numeric_limits<double>::quiet_NaN());
    peer.get_columns(i, columns.data());
    const KinematicsCheck check(truth.scene.model, truth.states[i].q);
    return truth.compare<T>(task == Task::frame ? check.frame() : check.momentum(), columns, 1);
  }
  if (task == Task::operational) {
    std::vector<int> links;
    for (const int tip : contest.mechanism.tips()) links.push_back(contest.mechanism.last_dof(tip));
    const MatrixX<double> J = KinematicsCheck(truth.scene.model, truth.states[i].q).local(links);
    MatrixX<double> X =
        MatrixX<double>::Constant(J.rows(), J.rows(), std::numeric_limits<double>::quiet_NaN());
    peer.get_operational(i, X.data());
    return truth.compare<T>(MatrixX<double>(J * truth.X[i] * J.transpose()), X, truth.condition[i]);
  }
  const bool is_mass = task == Task::mass || task == Task::mass_triangle;
  if (is_mass || task == Task::inverse || task == Task::inverse_triangle) {
    auto matrix = poisoned();
    peer.get_matrix(i, matrix.data());
    return is_mass ? truth.compare<T>(truth.M[i], matrix, 1)
                   : truth.compare<T>(truth.X[i], matrix, truth.condition[i]);
  }
  VectorX<double> a = VectorX<double>::Constant(nv, std::numeric_limits<double>::quiet_NaN());
  if (task == Task::inverse_dynamics || task == Task::regressor) {
    if (task == Task::regressor)
      peer.get_regressed_torque(i, a.data());
    else
      peer.get_torque(i, a.data());
    return truth.compare<T>(torque(truth.scene.model, truth.states[i]), a, 1);
  }
  peer.get_acceleration(i, a.data());
  return truth.compare<T>(truth.a[i], a, truth.condition[i]);
}

// Numbers of a state that are given to a call or are its result.
double least_numbers(const Mechanism& mechanism, Task task) {
  const double nq = mechanism.nq, nv = mechanism.nv, rows = 6.0 * mechanism.tips().size();
  switch (task) {
    case Task::acceleration:
    case Task::inverse_dynamics:
      return nq + 3 * nv;
    case Task::inverse:
    case Task::mass:
      return nq + nv * nv;
    case Task::inverse_triangle:
    case Task::mass_triangle:
      return nq + nv * (nv + 1) / 2;
    case Task::derivatives:
      return nq + 2 * nv + 3 * nv * nv;
    case Task::frame:
      return nq + 12 + 6 * nv;
    case Task::momentum:
      return nq + 3 + 6 * nv;
    case Task::operational:
      return nq + rows * rows;
    case Task::regressor:
      return nq + 2 * nv + 10 * nv * nv;
  }
  return 0;
}

void run_task(benchmark::State& run, const Contest& contest, Peer& peer, Task task, bool batch) {
  const Case& truth = contest.truth_of(peer);
  if (!truth.flaw.empty()) return run.SkipWithError(truth.flaw.c_str());
  // A batch that is a loop leaves its last result only.
  const bool as_one = batch && peer.has_batch(task);
  for (int i = 0; i < truth.verified(); ++i) {
    if (!(as_one ? peer.batch(task) : peer.call(task, i))) return run.SkipWithError("failed");
    const std::string flaw = peer.is_float32() ? judge<float>(contest, peer, task, i)
                                               : judge<double>(contest, peer, task, i);
    if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
  }
  int i = 0;
  bool good = true;
  const long before = allocations;
  for (auto _ : run) {
    good = (batch ? peer.batch(task) : peer.call(task, i)) && good;
    benchmark::ClobberMemory();
    if (++i == batch_size) i = 0;
  }
  run.counters["allocations"] = static_cast<double>(allocations - before) / run.iterations();
  if (const double s = peer.seconds_to_generate(task); s > 0) run.counters["generate_s"] = s;
  if (!good) return run.SkipWithError("failed");
  const double size = peer.is_float32() ? sizeof(float) : sizeof(double);
  count(run, peer.flops(task, batch), batch ? batch_size : 1,
        batch && !as_one ? 0 : size * least_numbers(contest.mechanism, task));
}

void add_tasks(std::shared_ptr<const Contest> contest) {
  struct Timed {
    Task task;
    const char* name;
    bool batch;
  };
  static constexpr Timed tasks[] = {
      {Task::acceleration, "acceleration", false},
      {Task::acceleration, "acceleration_batch", true},
      {Task::inverse_dynamics, "inverse_dynamics", false},
      {Task::inverse_dynamics, "inverse_dynamics_batch", true},
      {Task::inverse_triangle, "inverse_triangle", false},
      {Task::mass_triangle, "mass_triangle", false},
      {Task::inverse, "inverse", false},
      {Task::inverse, "inverse_batch", true},
      {Task::mass, "mass", false},
      {Task::mass, "mass_batch", true},
      {Task::derivatives, "derivatives", false},
      {Task::derivatives, "derivatives_batch", true},
      {Task::frame, "frame", false},
      {Task::frame, "frame_batch", true},
      {Task::momentum, "momentum", false},
      {Task::momentum, "momentum_batch", true},
      {Task::operational, "operational", false},
      {Task::operational, "operational_batch", true},
      {Task::regressor, "regressor", false},
      {Task::regressor, "regressor_batch", true},
  };
  constexpr int most_in_batches = 180;  // DoF: 1024 matrices of more take over 256 MiB
  const bool large = contest->truth.scene.model.nv() > most_in_batches;
  for (const auto& owned : contest->peers) {
    Peer* peer = owned.get();
    const auto has_states = std::make_shared<bool>(false);
    for (const Timed& timed : tasks) {
      const bool matrices = timed.task == Task::inverse || timed.task == Task::mass ||
                            timed.task == Task::derivatives || timed.task == Task::regressor;
      if (!peer->can(timed.task) || (timed.batch && matrices && large)) continue;
      const auto run_one = [=](benchmark::State& run) {
        if (!*has_states)
          for (const State& state : contest->truth.states)
            peer->add_state(state.q.data(), state.qd.data(), state.tau.data());
        *has_states = true;
        run_task(run, *contest, *peer, timed.task, timed.batch);
      };
      const std::string scene = contest->truth.scene.name;
      benchmark::RegisterBenchmark(
          name_of(timed.name, peer->name(), scene, peer->is_float32()).c_str(), run_one)
          ->Unit(timed.batch ? benchmark::kMicrosecond : benchmark::kNanosecond);
    }
  }
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed) {
  const auto modules = load_modules();
  std::set<std::string> versions;
  for (const Scene& scene : scenes) {
    const auto contest = std::make_shared<const Contest>(scene, seed, modules);
    for (const auto& peer : contest->peers) versions.insert(peer->version());
    add_tasks(contest);
  }
  register_peak();
  register_bandwidths();
  std::string all;
  for (const std::string& version : versions)
    if (!version.empty()) all += (all.empty() ? "" : "; ") + version;
  benchmark::AddCustomContext("peers", all);
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  return Driver{"bench_peers",
                "Time of the fast path against other libraries.",
                timed_call,
                "",
                {"iiwa14", "chain:31", "g1", "chain:100", "chain:500"}}
      .run(argc, argv, add_scenes);
}
