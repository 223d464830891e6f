// bench_constrained: accelerations of robots with closed loops, of one state and of 1024 in one call, and A = J M^-1 J' of their
// loops, beside Pinocchio's (peers/pinocchio_loops.cpp) where its headers are found (scripts/setup --peers, or PINOCCHIO_INCLUDE).
//
// Names are task/variant/scene/precision; tasks are constrained, constrained_batch and delassus. Constraints are the points of the
// scene's file, exact. Rows of planar loops repeat what the joints say, so that accelerations take the proximal method. All states
// stand where the file starts, in which its loops are closed, and have velocities that the loops allow, but else are random.
//
// Everything is verified before it is timed. With |x| = max over j of |x(j)| / M^-1(j,j)^1/2 a perturbation of u in the factors of
// M and of A moves a by
//   |da| <= c u (kappa(M) + kappa(A)) |a|,  c = 1000 nv, as in case.hpp
// with kappa(A) of the rows that do not repeat others, both scaled to unit diagonal; and d max A(i,i) more where rows are
// added to inertias with a stiffness d. In float32 that is no bound; there
// it is the tolerance of Dynamics<float>, of the same state in double. Ours is to satisfy Newton's and Euler's equations in double too.
#include <benchmark/benchmark.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "algorithms/study/inverse_mass/condition.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "benchmarks/peers/loops.hpp"
#include "benchmarks/peers/mechanism.hpp"
#include "kalmarm/constrained_dynamics.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to accelerations and forces of the constraints, by the proximal method to "
    "rounding; delassus: from q to J M^-1 J'. Memory is taken before.";
constexpr int verified = 5;

// One state of float is answered in double; in rows M^-1 has float's digits, and rows that repeat each other do so to them.
template <class T>
constexpr double proximal = std::is_same_v<T, float> ? 1e-4 : 1e-8;

// What is right of a state.
struct Right {
  VectorX<double> a, root_W;
  MatrixX<double> A;
  double condition;  // kappa(M) + kappa(A)

  // Of the largest |x(j)| / M^-1(j,j)^1/2.
  double error_of(const VectorX<double>& x) const {
    return (x - a).cwiseQuotient(root_W).cwiseAbs().maxCoeff() /
           a.cwiseQuotient(root_W).cwiseAbs().maxCoeff();
  }
};

// A scene with its loops, and states in which they are closed.
class Closed {
 public:
  std::string name;
  RobotModel model;
  std::vector<Constraint> points;
  Model<double> mechanism_model;
  Mechanism mechanism;
  std::vector<State> states;
  int rows = 0;
  std::string flaw;  // of ours in double

  Closed(const Scene& scene, std::uint64_t seed) : name(scene.name) {
    if (scene.file.empty()) throw InputError("scene '" + scene.name + "' has no file with loops");
    LoadOptions read = scene.read;
    read.takes_constraints = true;
    const LoadedRobot robot = load_robot(scene.file, read);
    model = robot.model;
    for (const Constraint& one : robot.constraints)
      if (one.kind == Constraint::Kind::point)
        points.push_back({.name = one.name, .first = one.first, .second = one.second});
    if (points.empty()) throw InputError(scene.file + ": has no connect constraint");
    mechanism_model = model_of(model);
    mechanism = make_mechanism(mechanism_model);
    ConstrainedDynamics<double> constrained = dynamics<double>();
    rows = constrained.rows();
    VectorX<double> impulses(rows);
    for (State& state : random_states(scene, batch_size, seed)) {
      state.q = Eigen::Map<const VectorX<double>>(robot.home.data(), model.nq);
      const VectorX<double> any = state.qd;
      if (!constrained.impulse(state.q, any, state.qd, impulses))
        throw InputError(scene.file + ": its loops are singular where it starts");
      states.push_back(std::move(state));
    }
    for (int i = 0; i < verified && flaw.empty(); ++i) solve(states[i]);
  }
  Closed(const Closed&) = delete;  // the mechanism refers to its model

  template <class T>
  ConstrainedDynamics<T> dynamics() const {
    return {model, points, {.proximal = proximal<T>}};
  }
  const Right& right(int i) const { return right_[i]; }
  template <class T>
  double bound(int i, double stiffness = 0) const {
    if (std::is_same_v<T, float>) return default_tolerance<float>;
    const Right& right = right_[i];
    const double amplified = right.condition + stiffness * right.A.diagonal().maxCoeff();
    return 1000 * model.nv() * unit_roundoff<double>() * amplified;
  }

 private:
  void solve(const State& s) {
    ConstrainedDynamics<double> constrained = dynamics<double>();
    Dynamics<double> open(model);
    const int nv = model.nv();
    Right right{.a = VectorX<double>(nv), .root_W = {}, .A = {}, .condition = 0};
    VectorX<double> forces(rows), torque(nv);
    MatrixX<double> Jt(nv, rows), M(nv, nv), W(nv, nv);
    if (!constrained.forward_dynamics(s.q, s.qd, s.tau, right.a, forces) ||
        !open.inverse_mass(s.q, W)) {
      flaw = "refused";
      return;
    }
    constrained.evaluate(s.q, {.jacobian = Jt});
    open.inverse_dynamics(s.q, s.qd, right.a, torque);
    open.mass(s.q, M);
    right.A = Jt.transpose() * W * Jt;
    right.root_W = W.diagonal().cwiseSqrt();
    const VectorX<double> size = right.A.diagonal().cwiseSqrt().cwiseInverse();
    const VectorX<double> values = Eigen::SelfAdjointEigenSolver<MatrixX<double>>(
                                       size.asDiagonal() * right.A * size.asDiagonal())
                                       .eigenvalues();
    const double largest = values[rows - 1];
    double least = largest;
    for (const double value : values)
      if (value > proximal<double> * largest) least = std::min(least, value);
    right.condition = scaled_condition_bound(M, W) + largest / least;
    const double missed = (torque - s.tau - Jt * forces).norm() / torque.norm(),
                 bound = 1000 * nv * unit_roundoff<double>();
    if (!(missed <= bound)) flaw = wrong(missed, bound);
    right_.push_back(std::move(right));
  }

  std::vector<Right> right_;
};

// "" where call(i) of the states that are verified gives their accelerations.
template <class T, class Call>
std::string flaw_of(const Closed& c, const Call& call, double stiffness = 0) {
  std::string flaw = c.flaw;
  for (int i = 0; i < verified && flaw.empty(); ++i) {
    const double error = c.right(i).error_of(call(i)), bound = c.bound<T>(i, stiffness);
    if (!(error <= bound)) flaw = wrong(error, bound);
  }
  return flaw;
}

template <class T>
void add_ours(const std::shared_ptr<const Closed>& c) {
  const auto robot = std::make_shared<ConstrainedDynamics<T>>(c->dynamics<T>());
  const auto pool = std::make_shared<const Pool<T>>(c->states);
  const int nv = c->model.nv(), m = c->rows;
  const bool is_float32 = std::is_same_v<T, float>;
  const auto a = std::make_shared<VectorX<T>>(nv), forces = std::make_shared<VectorX<T>>(m);
  const auto call = [=](int i) {
    return robot->forward_dynamics(pool->q[i], pool->qd[i], pool->tau[i], *a, *forces);
  };
  add_benchmark(
      name_of("constrained", "ConstrainedDynamics", c->name, is_float32),
      [=] {
        return flaw_of<T>(*c, [&](int i) -> VectorX<double> {
          return call(i) ? VectorX<double>(a->template cast<double>())
                         : VectorX<double>::Constant(nv, NAN);
        });
      },
      [=](int i) {
        benchmark::DoNotOptimize(call(i));
        benchmark::DoNotOptimize(a->data());
      });
  const auto out = std::make_shared<std::vector<T>>(std::size_t(batch_size) * nv),
             of_rows = std::make_shared<std::vector<T>>(std::size_t(batch_size) * m);
  const auto outcomes = std::make_shared<std::vector<Outcome>>(batch_size);
  const auto batch = [=] {
    return robot->forward_dynamics(pool->q_rows, pool->qd_rows, pool->tau_rows, *out, *of_rows,
                                   *outcomes);
  };
  add_benchmark(
      name_of("constrained_batch", "ConstrainedDynamics", c->name, is_float32),
      [=]() -> std::string {
        if (batch() != 0) return "refused";
        return flaw_of<T>(*c, [&](int i) -> VectorX<double> {
          return Eigen::Map<const VectorX<T>>(out->data() + i * nv, nv).template cast<double>();
        });
      },
      [=](int) {
        benchmark::DoNotOptimize(batch());
        benchmark::DoNotOptimize(out->data());
      },
      0, batch_size);
}

// "" where A is that of where the scene's file starts.
std::string flaw_of_delassus(const Closed& c, const MatrixX<double>& A) {
  if (!c.flaw.empty()) return c.flaw;
  const MatrixX<double>& right = c.right(0).A;
  const double error = (A - right).norm() / right.norm(), bound = c.bound<double>(0);
  return error <= bound ? "" : wrong(error, bound);
}

// J by ConstrainedDynamics, M^-1 J' by factors that are kept.
void add_delassus(const std::shared_ptr<const Closed>& c) {
  const auto robot = std::make_shared<ConstrainedDynamics<double>>(c->dynamics<double>());
  const auto dynamics = std::make_shared<Dynamics<double>>(
      c->model, DynamicsOptions{.question = {.want = {Want::solve}}});
  const auto Jt = std::make_shared<MatrixX<double>>(c->model.nv(), c->rows),
             X = std::make_shared<MatrixX<double>>(*Jt),
             A = std::make_shared<MatrixX<double>>(c->rows, c->rows);
  const auto call = [=](int i) {
    const VectorX<double>& q = c->states[i].q;
    robot->evaluate(q, {.jacobian = *Jt});
    benchmark::DoNotOptimize(dynamics->factor(q));
    benchmark::DoNotOptimize(dynamics->solve(*Jt, *X));
    A->noalias() = Jt->transpose() * *X;
    benchmark::DoNotOptimize(A->data());
  };
  add_benchmark(
      name_of("delassus", "Dynamics<solve>", c->name, false),
      [=] {
        call(0);
        return flaw_of_delassus(*c, *A);
      },
      call);
}

#ifdef KALMARM_HAS_PINOCCHIO
void add_pinocchio(const std::shared_ptr<const Closed>& c) {
  PeersOfLoops peers = pinocchio_loops(c->mechanism, c->points, c->states);
  const auto add = [&](const char* task, std::unique_ptr<LoopPeer> owned, const auto& verify) {
    const std::shared_ptr<LoopPeer> peer = std::move(owned);
    add_benchmark(
        name_of(task, peer->name(), c->name, false), [=] { return verify(*peer); },
        [=](int i) { peer->run(i); });
  };
  for (auto& peer : peers.accelerations)
    add("constrained", std::move(peer), [c](LoopPeer& one) {
      const auto result = [&](int i) {
        one.run(i);
        return one.result(i);
      };
      return flaw_of<double>(*c, result, one.stiffness());
    });
  for (auto& peer : peers.delassus)
    add("delassus", std::move(peer), [c](LoopPeer& one) {
      one.run(0);
      return flaw_of_delassus(*c, one.result(0).reshaped(c->rows, c->rows));
    });
}
#endif

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed) {
  for (const Scene& scene : scenes) {
    const auto c = std::make_shared<const Closed>(scene, seed);
    add_ours<double>(c);
    add_ours<float>(c);
    add_delassus(c);
#ifdef KALMARM_HAS_PINOCCHIO
    add_pinocchio(c);
#endif
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  return Driver{.name = "bench_constrained",
                .about = "Time of forward dynamics with closed loops.",
                .timed_call = timed_call,
                .scenes = {"cassie"}}
      .run(argc, argv, add_scenes);
}
