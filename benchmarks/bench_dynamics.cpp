// bench_dynamics: time of forward dynamics of one state by the fast path, in its conventional form
// and its square-root form, against Sequential<Conventional>. Batches: bench_batch.
//
// Names are task/variant/scene/precision. Everything is verified before it is timed (case.hpp).
// Counters: flops of a call (fast path only; sines and cosines are not counted), and flops per
// second.
#include <benchmark/benchmark.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/structured/dynamics.hpp"
#include "algorithms/structured/flops.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to the acceleration: kinematics, velocity and bias terms, gravity, the "
    "test for singularity. Memory is taken before. Each call takes the next of a pool of random "
    "states.";

// `solver` is a Solver or a StructuredDynamics.
template <class T, class S>
void add(const std::string& variant, std::shared_ptr<S> solver, double flops,
         std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool) {
  auto a = std::make_shared<VectorX<T>>(c->scene.model.nv());
  const auto call = [=](int i) {
    return solver->acceleration(pool->q[i], pool->qd[i], pool->tau[i], *a);
  };
  add_benchmark(
      name_of<T>("acceleration", variant, *c),
      [=] {
        std::string flaw = c->flaw;
        for (int i = 0; i < c->verified() && flaw.empty(); ++i) {
          a->setConstant(std::numeric_limits<T>::quiet_NaN());
          const Outcome outcome = call(i);
          flaw = outcome ? c->judge(i, *a) : describe(c->scene, outcome);
        }
        return flaw;
      },
      [=](int i) {
        benchmark::DoNotOptimize(call(i));
        benchmark::DoNotOptimize(a->data());
      },
      flops);
}

template <class T, class Form>
void add_form(const std::string& variant, std::shared_ptr<const Case> c,
              std::shared_ptr<const Pool<T>> pool) {
  const State& s = c->states[0];
  add<T>(variant, std::make_shared<StructuredDynamics<T, Form>>(c->scene.model.cast<T>()),
         acceleration_flops<Form>(c->scene.model, s.q, s.qd, s.tau), c, pool);
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  auto pool = std::make_shared<const Pool<T>>(c->states);
  add_form<T, CovarianceForm>("Structured", c, pool);
  add_form<T, SquareRootForm>("StructuredSquareRoot", c, pool);
  const char* usual = "Sequential<Conventional>";
  add<T>(usual, std::shared_ptr<Solver<T>>(make_solver<T>(usual, c->scene.model.cast<T>())), 0, c,
         pool);
}

void add_scenes(const std::vector<std::string>& scenes, std::uint64_t seed) {
  for (const std::string& what : scenes) {
    const auto c = std::make_shared<const Case>(load_scene(what), seed);
    add_all<double>(c);
    add_all<float>(c);
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  return Driver{"bench_dynamics", "Time of forward dynamics by the fast path.", timed_call}.run(
      argc, argv, add_scenes);
}
