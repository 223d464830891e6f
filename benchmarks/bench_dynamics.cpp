// bench_dynamics: time of forward dynamics of one state by the ladder at the tolerances that are
// contenders, against Sequential<Conventional>. Batches: bench_batch.
//
// Names are task/variant/scene/precision. Everything is verified before it is timed (case.hpp).
// Counters: flops of a call (the ladder only; sines and cosines are not counted), and flops per
// second.
#include <benchmark/benchmark.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/study/flops/flops.hpp"
#include "algorithms/study/solver.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau to the acceleration: kinematics, velocity and bias terms, gravity, the "
    "test for singularity. Memory is taken before. Each call takes the next of a pool of random "
    "states.";

template <class T>
void add(const RegisteredVariant<T>& variant, std::shared_ptr<const Case> c,
         std::shared_ptr<const Pool<T>> pool) {
  std::shared_ptr<Solver<T>> solver = variant.make(c->scene.model.cast<T>());
  const double flops = variant.traits.kind == VariantKind::ladder
                           ? flops_of(c->scene.model, Want::acceleration, variant.traits.tolerance)
                           : 0;
  auto a = std::make_shared<VectorX<T>>(c->scene.model.nv());
  const auto call = [=](int i) {
    return solver->acceleration(pool->q[i], pool->qd[i], pool->tau[i], *a);
  };
  add_benchmark(
      name_of<T>("acceleration", variant.name, *c),
      [=] {
        const auto poisoned = [&](int i) {
          a->setConstant(std::numeric_limits<T>::quiet_NaN());
          return call(i);
        };
        return flaw_of(*c, poisoned, [&](int i) { return c->judge(i, *a); });
      },
      [=](int i) {
        benchmark::DoNotOptimize(call(i));
        benchmark::DoNotOptimize(a->data());
      },
      flops);
}

template <class T>
void add_all(std::shared_ptr<const Case> c) {
  auto pool = std::make_shared<const Pool<T>>(c->states);
  for (const RegisteredVariant<T>& variant : registered_variants<T>())
    if ((variant.traits.kind == VariantKind::ladder && variant.traits.contender) ||
        variant.name == "Sequential<Conventional>")
      add<T>(variant, c, pool);
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
  return Driver{"bench_dynamics", "Time of forward dynamics by the ladder.", timed_call}.run(
      argc, argv, add_scenes);
}
