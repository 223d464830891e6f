// bench_derivatives: time of the derivatives of forward dynamics with respect to q, q' and tau, by
// the fast path, and by forward differences through its forward dynamics; and of the Jacobians over
// inertial parameters that a fit needs (inertial_jacobians.hpp).
//
// Names are task/variant/scene/precision. All are verified before they are timed, those of
// motion by derivative_check.hpp: what failed or is wrong is reported as an error and is not timed.
// Forward differences lose half the digits, and are held to what is left.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/derivative_check.hpp"
#include "benchmarks/driver.hpp"
#include "benchmarks/inertial_jacobians.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "derivatives: from q, qd and tau to the acceleration and its derivatives with respect to all "
    "three, nv x nv each, both triangles: kinematics, velocity and bias terms, gravity, the test "
    "for "
    "singularity. jacobian_*: from the log-Cholesky coordinates of all bodies to the residual of "
    "one sample and its Jacobian over them: inertias, kinematics, velocity terms, factors. Memory "
    "is taken before. One state a call, the next of a pool.";

template <class T>
class Analytic {
 public:
  explicit Analytic(const Model<double>& model)
      : robot_(plain(model), {.question = {.want = {Want::derivatives}}}) {}

  Outcome derivatives(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                      MatrixX<T>& da_dq, MatrixX<T>& da_dqd, MatrixX<T>& da_dtau, VectorX<T>& a) {
    return robot_.derivatives(q, qd, tau, {.dq = da_dq, .dqd = da_dqd, .dtau = da_dtau}, a);
  }

 private:
  Dynamics<T> robot_;
};

// Forward differences: 3 nv + 1 accelerations. tau enters linearly, so its step is 1.
template <class T>
class Differences {
 public:
  explicit Differences(const Model<double>& model)
      : model_(model.cast<T>()),
        robot_(plain(model), {.question = {.want = {Want::acceleration}}}),
        a_(model.nv()) {}

  Outcome derivatives(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                      MatrixX<T>& da_dq, MatrixX<T>& da_dqd, MatrixX<T>& da_dtau, VectorX<T>& a) {
    const T h = std::sqrt(std::numeric_limits<T>::epsilon());
    Outcome outcome = robot_.forward_dynamics(q, qd, tau, a);
    for (int k = 0; k < model_.nv() && outcome; ++k) {
      q_ = q;
      move(model_, k, h, q_);
      outcome = robot_.forward_dynamics(q_, qd, tau, a_);
      da_dq.col(k) = (a_ - a) / h;
      x_ = qd;
      x_[k] += h;
      if (outcome) outcome = robot_.forward_dynamics(q, x_, tau, a_);
      da_dqd.col(k) = (a_ - a) / h;
      x_ = tau;
      x_[k] += T(1);
      if (outcome) outcome = robot_.forward_dynamics(q, qd, x_, a_);
      da_dtau.col(k) = a_ - a;
    }
    return outcome;
  }

 private:
  Model<T> model_;
  Dynamics<T> robot_;
  VectorX<T> q_, x_, a_;
};

// `lost`: what the method itself multiplies the roundoff by.
template <class T, class Method>
void add(const std::string& variant, double lost, std::shared_ptr<const Case> c,
         std::shared_ptr<const Pool<T>> pool) {
  struct Work {
    Method method;
    std::unique_ptr<Solver<double>> reference;
    MatrixX<T> dq, dqd, dtau;
    VectorX<T> a;

    explicit Work(const Model<double>& model)
        : method(model),
          reference(make_solver<double>("Sequential<ArrayMGS>", model)),
          dq(model.nv(), model.nv()),
          dqd(dq),
          dtau(dq),
          a(model.nv()) {}
  };
  const auto work = std::make_shared<Work>(c->scene.model);
  const auto differentiate = [=](int i) {
    return work->method.derivatives(pool->q[i], pool->qd[i], pool->tau[i], work->dq, work->dqd,
                                    work->dtau, work->a);
  };
  const auto verify = [=] {
    std::string flaw = c->flaw;
    for (int i = c->verified() - 1; i >= 0 && flaw.empty(); --i) {
      for (MatrixX<T>* J : {&work->dq, &work->dqd, &work->dtau})
        J->setConstant(std::numeric_limits<T>::quiet_NaN());
      const Outcome outcome = differentiate(i);
      if (!outcome) return describe(c->scene, outcome);
      const double error = derivative_error(
          c->scene.model, *work->reference, c->states[i], work->dq.template cast<double>(),
          work->dqd.template cast<double>(), work->dtau.template cast<double>());
      const double bound = derivative_bound(c->bound<T>(lost * c->condition[i]));
      if (!(error <= bound)) flaw = wrong(error, bound);
    }
    return flaw;
  };
  add_benchmark(name_of<T>("derivatives", variant, *c), verify, [=](int i) {
    benchmark::DoNotOptimize(differentiate(i));
    benchmark::DoNotOptimize(work->dq.data());
  });
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  const auto pool = std::make_shared<const Pool<T>>(c->states);
  add<T, Analytic<T>>("Ladder<default>", 1, c, pool);
  add<T, Differences<T>>("Differences", 1 / std::sqrt(static_cast<double>(unit_roundoff<T>())), c,
                         pool);
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed) {
  for (const Scene& scene : scenes) {
    const auto c = std::make_shared<const Case>(scene, seed);
    add_all<double>(c);
    add_all<float>(c);
    add_inertial_jacobians(c);
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  return Driver{"bench_derivatives", "Time of derivatives of forward dynamics and of fits.",
                timed_call}
      .run(argc, argv, add_scenes);
}
