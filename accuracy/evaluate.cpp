// evaluate: one variant on given or random states -> JSON.
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "accuracy/real.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/solver.hpp"
#include "robots/mujoco_solver.hpp"
#include "robots/program.hpp"
#include "robots/scene.hpp"
#include "robots/state_file.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

struct Options {
  std::string scene, variant, precision = "float64", states, out;
  std::vector<std::string> want = {"mass", "inverse", "acceleration"};
  int random = 0, digits = 50;
  std::uint64_t seed = 1;
  bool list = false;
};

constexpr const char* mujoco_variant = "MuJoCo";

template <class T>
json to_json(const VectorX<T>& x) {
  json out = json::array();
  for (const T& entry : x) out.push_back(static_cast<double>(entry));
  return out;
}

template <class T>
json to_json(const MatrixX<T>& X) {
  json rows = json::array();
  for (int i = 0; i < X.rows(); ++i) rows.push_back(to_json<T>(VectorX<T>(X.row(i))));
  return rows;
}

[[noreturn]] void unknown_variant(const Options& options, const std::string& why) {
  std::string names = mujoco_variant;
  for (const auto& variant : registered_variants<double>()) names += ", " + variant.name;
  throw InputError("variant '" + options.variant + "' " + why + " (known: " + names + ")");
}

template <class T>
std::unique_ptr<Solver<T>> make_contender(const Options& options, const Scene& scene,
                                          const Model<T>& model) {
  if (options.variant == mujoco_variant) {
    if constexpr (std::is_same_v<T, double>)
      return std::make_unique<MujocoSolver>(mujoco_of(scene));
    else
      unknown_variant(options, "has no precision " + options.precision);
  }
  if (auto solver = make_solver<T>(options.variant, model)) return solver;
  for (const auto& variant : registered_variants<double>())
    if (variant.name == options.variant)
      unknown_variant(options, "has no precision " + options.precision);
  unknown_variant(options, "is unknown");
}

void check(const Outcome& outcome, const Options& options, const Scene& scene, int state) {
  if (outcome) return;
  const std::string where = scene.name + ": state " + std::to_string(state) + ": ";
  const std::string by = " (" + options.variant + ", " + options.precision + ")";
  if (outcome.joint < 0) throw InputError(where + "the result is not finite" + by);
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "D = %.3g against a scale of %.3g", outcome.D,
                outcome.scale);
  throw InputError(where + "mass matrix " + to_string(outcome.status) + " at joint '" +
                   scene.model.name(outcome.joint) + "', " + numbers + by);
}

template <class T>
json evaluate(const Options& options, const Scene& scene, const std::vector<State>& states) {
  const Model<T> model = scene.model.cast<T>();
  const std::unique_ptr<Solver<T>> solver = make_contender<T>(options, scene, model);
  const std::set<std::string> want(options.want.begin(), options.want.end());
  if (want.contains("factors") && !solver->has_factors())
    throw InputError("variant '" + options.variant + "' has no factors D and g");

  const int nv = model.nv();
  const T poison = std::numeric_limits<T>::quiet_NaN();
  RandomModel<T> rm(model);
  CompositeInertia<T> composite(model);
  json out = json::array();
  Progress progress(static_cast<int>(states.size()));
  for (const State& state : states) {
    const int index = static_cast<int>(out.size());
    progress.step("state " + std::to_string(index));
    const VectorX<T> q = state.q.cast<T>(), qd = state.qd.cast<T>(), tau = state.tau.cast<T>();
    json entry = {
        {"qpos", to_json(state.q)}, {"qvel", to_json(state.qd)}, {"tau", to_json(state.tau)}};
    if (want.contains("mass")) {
      MatrixX<T> M = MatrixX<T>::Constant(nv, nv, poison);
      if (auto* mujoco = dynamic_cast<MujocoSolver*>(solver.get())) {
        if constexpr (std::is_same_v<T, double>) mujoco->mass(q, M);
      } else {
        set_position(model, q, rm);
        mass_matrix(model, rm, composite, Eigen::Ref<MatrixX<T>>(M));
      }
      entry["mass"] = to_json(M);
    }
    if (want.contains("inverse")) {
      MatrixX<T> X = MatrixX<T>::Constant(nv, nv, poison);
      check(solver->inverse(q, X), options, scene, index);
      entry["inverse"] = to_json(X);
    }
    if (want.contains("acceleration")) {
      VectorX<T> a = VectorX<T>::Constant(nv, poison);
      check(solver->acceleration(q, qd, tau, a), options, scene, index);
      entry["acceleration"] = to_json(a);
    }
    if (want.contains("factors")) {
      VectorX<T> D = VectorX<T>::Constant(nv, poison);
      MatrixX<T> g = MatrixX<T>::Constant(6, nv, poison);
      check(solver->factors(q, D, g), options, scene, index);
      entry["factors"] = {{"D", to_json(D)}, {"g", to_json<T>(MatrixX<T>(g.transpose()))}};
    }
    out.push_back(std::move(entry));
  }
  return out;
}

int run(const Options& options) {
  if (options.list) {
    for (const auto& variant : registered_variants<double>())
      std::printf("%s\n", variant.name.c_str());
    std::printf("%s\n", mujoco_variant);
    return 0;
  }
  if (options.scene.empty()) throw InputError("SCENE is required");
  if (options.variant.empty()) throw InputError("--variant is required; --list prints them");
  if (options.out.empty()) throw InputError("--out is required");

  const Scene scene = load_scene(options.scene);
  std::vector<State> states;
  if (!options.states.empty()) {
    StateFile file = read_states(scene, options.states);
    if (file.normalized > 0)
      std::fprintf(stderr, "evaluate: note: %d quaternion(s) normalised in %s\n", file.normalized,
                   options.states.c_str());
    states = std::move(file.states);
  } else {
    states = random_states(scene, options.random > 0 ? options.random : 1, options.seed);
  }

  json document = {{"robot", scene.name},
                   {"nv", scene.model.nv()},
                   {"dofs", scene.model.names()},
                   {"variant", options.variant},
                   {"precision", options.precision}};
  if (options.precision == "float32") {
    document["states"] = evaluate<float>(options, scene, states);
  } else if (options.precision == "float64") {
    document["states"] = evaluate<double>(options, scene, states);
  } else {
    const Digits digits(options.digits);
    document["states"] = evaluate<Real>(options, scene, states);
  }
  write_file(options.out, document.dump() + "\n");
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("One variant on given or random states: M, M^-1 and a = M^-1 (tau - bias) as JSON.",
               "evaluate");
  Options options;
  app.add_option("SCENE", options.scene, scene_help);
  app.add_flag("--list", options.list, "print the variants, one a line");
  app.add_option("--variant", options.variant, "e.g. 'Sequential<ArrayMGS>'");
  app.add_option("--precision", options.precision, "float32, float64 or mp (multi-precision)")
      ->check(CLI::IsMember({"float32", "float64", "mp"}))
      ->capture_default_str();
  app.add_option("--digits", options.digits, "decimal digits of mp")
      ->check(CLI::Range(20, 10000))
      ->capture_default_str();
  auto* file = app.add_option("--states", options.states, "JSON file with qpos, qvel and tau");
  app.add_option("--random", options.random, "number of random states")
      ->check(CLI::PositiveNumber)
      ->excludes(file);
  app.add_option("--seed", options.seed, "of the random states")->capture_default_str();
  app.add_option("--want", options.want, "any of mass, inverse, acceleration, factors")
      ->delimiter(',')
      ->check(CLI::IsMember({"mass", "inverse", "acceleration", "factors"}))
      ->capture_default_str();
  app.add_option("--out", options.out, "output file");
  return run_program(app, argc, argv, [&] { return run(options); });
}
