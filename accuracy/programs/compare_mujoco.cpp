// compare_mujoco: every variant against MuJoCo's mass matrix and acceleration.
//
// MuJoCo loads the file a second time, untouched, so that what our loader makes of it is compared
// too. Where it cannot (it refuses the file, or options make another robot of it), the output says
// why, and its model of what we read of the file stands in.
//
// MuJoCo is a reference for M, whose entries both sides form without cancellation: bound 1e-13. For
// a = M^-1 (tau - bias) it is one more contender with an error of its own, that of a factorisation
// of M: up to nv u kappa, with kappa the condition number of M scaled to unit diagonal. The bound
// is 1e-9, or nv u kappa where that is more (kappa from Frobenius norms, at least the true one).
#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/programs/step_comparison.hpp"
#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/inverse_mass/condition.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/scene/memory_limit.hpp"
#include "robots/scene/mujoco_solver.hpp"
#include "robots/scene/untouched.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

constexpr double mass_bound = 1e-13, least_acceleration_bound = 1e-9;

struct Options {
  std::vector<std::string> scenes;
  LoadOptions read;
  std::string json_file;
  int random = 100;
  std::uint64_t seed = 1;
  bool step = false;
  StepOptions of_step;
};

// What MuJoCo says of a scene's states.
struct Answers {
  std::vector<MatrixX<double>> mass, inverse;
  std::vector<VectorX<double>> acceleration;
  double acceleration_bound = least_acceleration_bound;
};

struct Spread {
  std::vector<double> values;

  double max() const { return *std::max_element(values.begin(), values.end(), nan_last); }
  double median() const {
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end(), nan_last);
    const std::size_t n = sorted.size();
    return n % 2 ? sorted[n / 2] : (sorted[n / 2 - 1] + sorted[n / 2]) / 2;
  }
  json to_json() const {
    if (values.empty()) return {{"max", nullptr}, {"median", nullptr}};
    return {{"max", max()}, {"median", median()}};
  }

 private:
  static bool nan_last(double a, double b) { return a < b || (a == a && b != b); }
};

struct Row {
  std::string variant, precision;
  Spread acceleration, inverse;
  int failures = 0;

  bool pass(double bound) const {
    return precision != "float64" || (failures == 0 && acceleration.max() <= bound);
  }
};

Answers answers_of(MujocoSolver& mujoco, const std::vector<State>& states, int nv,
                   const std::string& scene) {
  Answers out;
  for (const State& state : states) {
    MatrixX<double> M(nv, nv), X(nv, nv);
    VectorX<double> a(nv);
    mujoco.mass(state.q, M);
    const Outcome inverse = mujoco.inverse(state.q, X);
    const Outcome acceleration = mujoco.acceleration(state.q, state.qd, state.tau, a);
    if (!inverse || !acceleration)
      throw InputError(scene + ": MuJoCo cannot factor the mass matrix of state " +
                       std::to_string(out.mass.size()));
    out.acceleration_bound = std::max(out.acceleration_bound,
                                      nv * unit_roundoff<double>() * scaled_condition_bound(M, X));
    out.mass.push_back(M);
    out.inverse.push_back(X);
    out.acceleration.push_back(a);
  }
  return out;
}

template <class T>
void compare_variants(const Scene& scene, const std::vector<State>& states,
                      const Answers& reference, const std::string& precision,
                      std::vector<Row>& rows) {
  const Model<T> model = scene.model.cast<T>();
  const int nv = model.nv();
  const T poison = std::numeric_limits<T>::quiet_NaN();
  for (const RegisteredVariant<T>& variant : registered_variants<T>()) {
    if (!variant.traits.contender) continue;
    const std::unique_ptr<Solver<T>> solver = variant.make(model);
    Row row{variant.name, precision, {}, {}, 0};
    for (std::size_t i = 0; i < states.size(); ++i) {
      const VectorX<T> q = states[i].q.cast<T>();
      VectorX<T> a = VectorX<T>::Constant(nv, poison);
      MatrixX<T> X = MatrixX<T>::Constant(nv, nv, poison);
      const bool ok = static_cast<bool>(solver->acceleration(q, states[i].qd.cast<T>(),
                                                             states[i].tau.cast<T>(), a)) &&
                      static_cast<bool>(solver->inverse(q, X));
      if (!ok) {
        ++row.failures;
        continue;
      }
      const VectorX<double>& a0 = reference.acceleration[i];
      const MatrixX<double>& X0 = reference.inverse[i];
      row.acceleration.values.push_back((a.template cast<double>() - a0).norm() / a0.norm());
      row.inverse.values.push_back((X.template cast<double>() - X0).norm() / X0.norm());
    }
    rows.push_back(std::move(row));
  }
}

void print(const Scene& scene, std::size_t states, const Reference& theirs,
           const Answers& reference, double mass, const json& mass_variants,
           const std::vector<Row>& rows) {
  std::printf("%s, %zu states against MuJoCo %s of %s\n", scene.name.c_str(), states,
              mujoco_version(), theirs.words().c_str());
  std::printf("  M: largest relative error %.2e, bound %.0e  %s\n", mass, mass_bound,
              mass <= mass_bound ? "ok" : "EXCEEDED");
  for (const json& one : mass_variants)
    std::printf("    %-24s %14.2e\n", one["variant"].get<std::string>().c_str(),
                one["mass"]["max"].get<double>());
  std::printf("  acceleration: bound in float64 %.2g\n", reference.acceleration_bound);
  std::printf("  %-26s %-9s %14s %14s %9s\n", "variant", "precision", "acceleration", "inverse",
              "failures");
  for (const Row& row : rows) {
    const bool any = !row.acceleration.values.empty();
    std::printf("  %-26s %-9s %14.2e %14.2e %9d%s\n", row.variant.c_str(), row.precision.c_str(),
                any ? row.acceleration.max() : std::nan(""), any ? row.inverse.max() : std::nan(""),
                row.failures, row.pass(reference.acceleration_bound) ? "" : "  EXCEEDED");
  }
}

// The scene's JSON record; its table goes to standard output, unless the JSON does.
json compare(const Scene& scene, const Options& options) {
  const Model<double>& model = scene.model;
  const int nv = model.nv();
  refuse_large(scene.name + ": matrices of " + std::to_string(options.random) + " states",
               2.0 * options.random * nv * nv * sizeof(double));
  const Reference theirs = reference_of(scene);
  MujocoSolver mujoco(theirs.model);
  const std::vector<State> states = random_states(scene, options.random, options.seed);
  const Answers reference = answers_of(mujoco, states, nv, scene.name);

  Spread mass;  // of all variants that give M
  json mass_variants = json::array();
  for (const RegisteredVariant<double>& variant : registered_variants<double>(Want::mass)) {
    const std::unique_ptr<Solver<double>> solver = variant.make(model);
    Spread own;
    for (std::size_t i = 0; i < states.size(); ++i) {
      MatrixX<double> M =
          MatrixX<double>::Constant(nv, nv, std::numeric_limits<double>::quiet_NaN());
      solver->mass(states[i].q, M);
      own.values.push_back((M - reference.mass[i]).norm() / reference.mass[i].norm());
    }
    mass.values.insert(mass.values.end(), own.values.begin(), own.values.end());
    mass_variants.push_back({{"variant", variant.name}, {"mass", own.to_json()}});
  }
  std::vector<Row> rows;
  compare_variants<double>(scene, states, reference, "float64", rows);
  if (fits_float(plain(model)))
    compare_variants<float>(scene, states, reference, "float32", rows);
  else
    add_note(scene.name + ": float32 does not hold a number of the robot, and is left out");

  bool pass = mass.max() <= mass_bound;
  if (options.json_file != "-")
    print(scene, states.size(), theirs, reference, mass.max(), mass_variants, rows);
  json variants = json::array();
  for (const Row& row : rows) {
    pass = pass && row.pass(reference.acceleration_bound);
    json acceleration = row.acceleration.to_json();
    acceleration["bound"] =
        row.precision == "float64" ? json(reference.acceleration_bound) : json(nullptr);
    variants.push_back({{"variant", row.variant},
                        {"precision", row.precision},
                        {"acceleration", acceleration},
                        {"inverse", row.inverse.to_json()},
                        {"failures", row.failures}});
  }
  json mass_record = mass.to_json();
  mass_record["bound"] = mass_bound;
  const bool from_file = scene.mujoco != nullptr;
  return {{"scene", scene.name},
          {"states", states.size()},
          {"reference", to_json(theirs)},
          {"notes", from_file ? json(scene.mujoco->notes()) : json::array()},
          {"mass", mass_record},
          {"mass_variants", mass_variants},
          {"variants", variants},
          {"pass", pass}};
}

int run(Options options) {
  options.of_step.random = options.random;
  options.of_step.seed = options.seed;
  options.read.takes_steps = options.step;
  std::vector<Scene> scenes;
  for (const std::string& what : options.scenes) scenes.push_back(open_scene(what, options.read));
  OutputFile file = json_output(options.json_file);
  json document = {{"mujoco", mujoco_version()}, {"robots", json::array()}};
  bool pass = true;
  for (const Scene& scene : scenes) {
    json record = options.step ? compare_steps(scene, options.of_step, options.json_file == "-")
                               : compare(scene, options);
    pass = pass && record["pass"];
    document["robots"].push_back(std::move(record));
  }
  file.write(document.dump(1) + "\n");
  if (!pass) std::fprintf(stderr, "compare_mujoco: error: a bound is exceeded, see the table\n");
  return pass ? 0 : 1;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app(
      "Every variant against MuJoCo's own load of the file, untouched, on random states: M within "
      "1e-13, acceleration in float64 within 1e-9 or nv u kappa(M), whichever is more; or, with "
      "--step, implicit steps with the springs, dampers and actuators that are read of the file. "
      "Exit 1 beyond that.",
      "compare_mujoco");
  Options options;
  add_scene(app, options.scenes, options.read)->required();
  app.add_option("--random", options.random, "number of random states")
      ->check(number_of_states())
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the random states")
      ->check(any_seed())
      ->capture_default_str();
  auto* step = app.add_flag("--step", options.step,
                            "implicit steps against mj_step: Euler, implicitfast and discrete");
  app.add_option("--h", options.of_step.h, "of a step [s]")
      ->check(positive())
      ->needs(step)
      ->capture_default_str();
  app.add_option("--damping", options.of_step.damping,
                 "of every hinge and slide [N m s/rad or N s/m]; default: the file's")
      ->check(not_negative())
      ->needs(step);
  app.add_option("--stiffness", options.of_step.stiffness,
                 "likewise, about q = 0 or the file's reference [N m/rad or N/m]")
      ->check(not_negative())
      ->needs(step);
  app.add_option("--json", options.json_file, std::string("the table: ") + json_help);
  return run_program(app, argc, argv, [&] { return run(options); });
}
