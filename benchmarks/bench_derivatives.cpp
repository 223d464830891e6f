// bench_derivatives: time of the derivatives of forward dynamics with respect to q, q' and tau, by
// the fast path, and by forward differences through its forward dynamics.
//
// Names are task/variant/scene/precision. Both are verified before they are timed, against central
// differences in the precision above float64: a failed or wrong result is reported as an error and
// is not timed. Differences lose half the digits, and are held to what is left.
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
#include "algorithms/structured/derivatives.hpp"
#include "benchmarks/context.hpp"
#include "robots/program.hpp"
#include "robots/scene.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to the acceleration and its derivatives with respect to all three, nv x nv "
    "each, both triangles: kinematics, velocity and bias terms, gravity, the test for singularity. "
    "Memory is taken before. One state a call, the next of a pool.";

template <class T>
struct Derivatives {
  MatrixX<T> dq, dqd, dtau;
  VectorX<T> a;

  explicit Derivatives(int nv)
      : dq(MatrixX<T>::Constant(nv, nv, std::numeric_limits<T>::quiet_NaN())),
        dqd(dq),
        dtau(dq),
        a(VectorX<T>::Constant(nv, std::numeric_limits<T>::quiet_NaN())) {}
};

// q moved by h along the velocity of DoF k.
template <class T>
void move(const Model<T>& model, int k, const T& h, VectorX<T>& q) {
  int first = k;
  while (model.joint(first).coordinate == Coordinate::follower) --first;
  const int i = model.joint(first).q_index;
  if (model.joint(first).coordinate != Coordinate::quaternion) {
    q[i + k - first] += h;
    return;
  }
  Eigen::Quaternion<T> turn(std::cos(h / 2), T(0), T(0), T(0));
  turn.vec()[k - first] = std::sin(h / 2);
  const Eigen::Quaternion<T> turned =
      Eigen::Quaternion<T>(q[i], q[i + 1], q[i + 2], q[i + 3]) * turn;
  q.template segment<4>(i) << turned.w(), turned.x(), turned.y(), turned.z();
}

// Forward differences: 3 nv + 1 accelerations. tau enters linearly, so its step is 1.
template <class T>
class Differences {
 public:
  explicit Differences(const Model<T>& model) : model_(model), dynamics_(model), a_(model.nv()) {}

  Outcome derivatives(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                      MatrixX<T>& da_dq, MatrixX<T>& da_dqd, MatrixX<T>& da_dtau, VectorX<T>& a) {
    const T h = std::sqrt(std::numeric_limits<T>::epsilon());
    Outcome outcome = dynamics_.acceleration(q, qd, tau, a);
    for (int k = 0; k < model_.nv() && outcome; ++k) {
      q_ = q;
      move(model_, k, h, q_);
      outcome = dynamics_.acceleration(q_, qd, tau, a_);
      da_dq.col(k) = (a_ - a) / h;
      x_ = qd;
      x_[k] += h;
      if (outcome) outcome = dynamics_.acceleration(q, x_, tau, a_);
      da_dqd.col(k) = (a_ - a) / h;
      x_ = tau;
      x_[k] += T(1);
      if (outcome) outcome = dynamics_.acceleration(q, qd, x_, a_);
      da_dtau.col(k) = a_ - a;
    }
    return outcome;
  }

 private:
  Model<T> model_;
  StructuredDynamics<T> dynamics_;
  VectorX<T> q_, x_, a_;
};

// A scene, its states, and what is right for the first few of them.
struct Case {
  using Exact = long double;
  Scene scene;
  std::vector<State> states;
  std::vector<Derivatives<double>> truth;
  std::vector<double> condition;  // upper bound of that of M scaled to unit diagonal

  Case(const std::string& what, std::uint64_t seed)
      : scene(load_scene(what)),
        states(random_states(scene, std::clamp(100000 / scene.model.nv(), 20, 1000), seed)) {
    const int nv = scene.model.nv();
    RandomModel<double> rm(scene.model);
    CompositeInertia<double> composite(scene.model);
    MatrixX<double> M(nv, nv);
    for (int i = 0; i < (nv <= 100 ? 3 : 1); ++i) {
      truth.push_back(central_differences(states[i]));
      set_position(scene.model, states[i].q, rm);
      mass_matrix(scene.model, rm, composite, Eigen::Ref<MatrixX<double>>(M));
      condition.push_back(scaled_condition_bound(M, truth.back().dtau));
    }
  }

  Derivatives<double> central_differences(const State& state) const {
    const Model<Exact> model = scene.model.cast<Exact>();
    const StructuredModel<Exact> structured(model);
    StructuredWorkspace<Exact> ws(structured);
    const Exact h = 1e-6L;
    Derivatives<double> out(model.nv());
    VectorX<Exact> a(model.nv()), b(model.nv());
    const auto accelerate = [&](const VectorX<Exact>& q, const VectorX<Exact>& qd,
                                const VectorX<Exact>& tau, VectorX<Exact>& to) {
      structured_acceleration(structured, q.data(), qd.data(), tau.data(), ws, to.data());
    };
    const VectorX<Exact> q = state.q.cast<Exact>(), qd = state.qd.cast<Exact>(),
                         tau = state.tau.cast<Exact>();
    accelerate(q, qd, tau, a);
    out.a = a.cast<double>();
    for (int k = 0; k < model.nv(); ++k) {
      const VectorX<Exact> e = VectorX<Exact>::Unit(model.nv(), k);
      VectorX<Exact> ahead = q, behind = q;
      move(model, k, h, ahead);
      move(model, k, -h, behind);
      accelerate(ahead, qd, tau, a);
      accelerate(behind, qd, tau, b);
      out.dq.col(k) = ((a - b) / (2 * h)).cast<double>();
      accelerate(q, qd + h * e, tau, a);
      accelerate(q, qd - h * e, tau, b);
      out.dqd.col(k) = ((a - b) / (2 * h)).cast<double>();
      accelerate(q, qd, tau + e, a);
      accelerate(q, qd, tau - e, b);
      out.dtau.col(k) = ((a - b) / 2).cast<double>();
    }
    return out;
  }

  // "" where the derivatives of state i are right to `bound`, which counts roundoffs, and to the
  // digits that central differences have.
  template <class T>
  std::string judge(int i, const Derivatives<T>& x, double bound) const {
    const auto relative = [](const MatrixX<T>& is, const MatrixX<double>& should) {
      const double size = should.norm();
      return (is.template cast<double>() - should).norm() / (size > 0 ? size : 1);
    };
    const double errors[] = {relative(x.dq, truth[i].dq), relative(x.dqd, truth[i].dqd),
                             relative(x.dtau, truth[i].dtau), relative(x.a, truth[i].a)};
    const double error = *std::max_element(std::begin(errors), std::end(errors));
    if (error <= bound * condition[i] + 1e-6) return "";
    char text[80];
    std::snprintf(text, sizeof text, "wrong: error %.2g, bound %.2g", error, bound * condition[i]);
    return text;
  }
};

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

template <class T, class Solver>
void add(const std::string& variant, double bound, std::shared_ptr<const Case> c,
         std::shared_ptr<const Pool<T>> pool) {
  auto solver = std::make_shared<Solver>(c->scene.model.cast<T>());
  const auto run = [=](benchmark::State& run) {
    Derivatives<T> out(c->scene.model.nv());
    const auto call = [&](std::size_t i) {
      return solver->derivatives(pool->q[i], pool->qd[i], pool->tau[i], out.dq, out.dqd, out.dtau,
                                 out.a);
    };
    for (std::size_t i = 0; i < c->truth.size(); ++i) {
      const Outcome outcome = call(i);
      const std::string flaw = outcome ? c->judge(static_cast<int>(i), out, bound)
                                       : std::string(to_string(outcome.status));
      if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
    }
    std::size_t i = 0;
    for (auto _ : run) {
      benchmark::DoNotOptimize(call(i));
      benchmark::DoNotOptimize(out.dq.data());
      if (++i == pool->q.size()) i = 0;
    }
  };
  const std::string name = "derivatives/" + variant + "/" + c->scene.name +
                           (std::is_same_v<T, float> ? "/float32" : "/float64");
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kNanosecond);
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  auto pool = std::make_shared<const Pool<T>>(c->states);
  const double u = static_cast<double>(unit_roundoff<T>()), nv = c->scene.model.nv();
  add<T, StructuredDerivatives<T>>("Structured", 1000 * nv * u, c, pool);
  add<T, Differences<T>>("Differences", 1000 * nv * std::sqrt(u), c, pool);
}

int run(const std::vector<std::string>& scenes, std::uint64_t seed) {
  for (const std::string& what : scenes) {
    const auto c = std::make_shared<const Case>(what, seed);
    add_all<double>(c);
    add_all<float>(c);
  }
  add_context(timed_call);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  benchmark::Initialize(&argc, argv, [] {
    std::printf(
        "Usage: bench_derivatives SCENE... [--seed S] [flags of Google Benchmark]\n\n  SCENE: "
        "%s\n\n",
        scene_help);
    benchmark::PrintDefaultHelp();
  });
  CLI::App app("Time of the derivatives of forward dynamics.", "bench_derivatives");
  std::vector<std::string> scenes;
  std::uint64_t seed = 1;
  app.add_option("SCENE", scenes, scene_help)->required();
  app.add_option("--seed", seed, "of the random states")->capture_default_str();
  return run_program(app, argc, argv, [&] { return run(scenes, seed); });
}
