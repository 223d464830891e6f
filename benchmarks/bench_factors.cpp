// bench_factors: time of the factors of M, and of M^-1 tau by factors that are kept, for every
// contender of the registry and MuJoCo.
//
// Names are task/variant/scene/precision; tasks are factor and solve. Everything is verified before
// it is timed (case.hpp).
#include <benchmark/benchmark.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/study/solver.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "robots/scene/mujoco_solver.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "factor: from q to the factors of M, kinematics included. solve: from tau to M^-1 tau, by the "
    "factors of one state, which are kept. Memory is taken before. Each call takes the next of a "
    "pool of random states.";

template <class T>
void add(const std::string& variant, std::shared_ptr<Solver<T>> solver,
         std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool) {
  auto x = std::make_shared<VectorX<T>>(c->scene.model.nv());
  const auto verify = [=] {
    std::string flaw = c->flaw;
    for (int i = c->verified() - 1; i >= 0 && flaw.empty(); --i) {
      const Outcome outcome = solver->factor(pool->q[i]);
      if (!outcome) return describe(c->scene, outcome);
      x->setConstant(std::numeric_limits<T>::quiet_NaN());
      solver->solve(pool->tau[i], *x);
      flaw = c->compare<T>(c->X[i] * c->states[i].tau, *x, c->condition[i]);
    }
    return flaw;
  };
  add_benchmark(name_of<T>("factor", variant, *c), verify,
                [=](int i) { benchmark::DoNotOptimize(solver->factor(pool->q[i])); });
  add_benchmark(name_of<T>("solve", variant, *c), verify, [=](int i) {
    solver->solve(pool->tau[i], *x);
    benchmark::DoNotOptimize(x->data());
  });
}

template <class T>
void add_contenders(std::shared_ptr<const Case> c, std::shared_ptr<const Pool<T>> pool) {
  const Model<T> model = c->scene.model.cast<T>();
  for (const RegisteredVariant<T>& variant : registered_variants<T>())
    if (variant.traits.contender && variant.traits.gives(Want::solve))
      add<T>(variant.name, std::shared_ptr<Solver<T>>(variant.make(model)), c, pool);
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed) {
  for (const Scene& scene : scenes) {
    const auto c = std::make_shared<const Case>(scene, seed);
    const auto float64 = std::make_shared<const Pool<double>>(c->states);
    add_contenders<double>(c, float64);
    add_contenders<float>(c, std::make_shared<const Pool<float>>(c->states));
    add<double>("MuJoCo", std::make_shared<MujocoSolver>(mujoco_of(c->scene)), c, float64);
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  return Driver{"bench_factors", "Time of factoring M and of solving with factors that are kept.",
                timed_call}
      .run(argc, argv, add_scenes);
}
