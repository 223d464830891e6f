// export_mechanism: a scene, or one of its stresses (limits/stresses.hpp), as files that other engines
// read, with states and the true answers to them: what scripts/engines asks every engine about.
//
//   FOLDER/robot.xml    MJCF, whole
//   FOLDER/robot.urdf   where URDF has words for its joints, without armature
//   FOLDER/truth.json   states, truth, and what the files do not say
//
// Parameters and states are rounded to float32 first unless --rounded says otherwise: every engine then
// holds in float32 what it is asked about, but for numbers that it derives from them. Truth is exact for
// what was rounded, and proven (truth.hpp). `rounding` tells how far the same states' true answers are
// apart with parameters as they were given: the error of an engine that rounds nothing else.
// An engine that knows no armature is asked about the mechanism without; `without_armature` has its truth.
// `acceleration_rest` and `inverse_dynamics_rest` are what is left of these numbers when they are rounded to double: the sum
// of both has 32 digits.
// Derivatives of a = X (tau - bias), of a mechanism of hinges and slides alone, are those of inverse
// dynamics t(q, qd, qdd) at the true a,
//   da/dq = -X dt/dq,   da/dqd = -X dt/dqd                                                 (1)
// by central differences in multi-precision, with steps of a third of its digits by q, of 1 by qd, of which t
// is a polynomial of second degree.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "accuracy/limits/stresses.hpp"
#include "accuracy/measures/measures.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/truth/truth_cache.hpp"
#include "accuracy/truth/world_mechanics.hpp"
#include "robots/scene/state_file.hpp"
#include "robots/scene/write_mjcf.hpp"
#include "robots/scene/write_urdf.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

constexpr int largest = 255;              // DoF: matrices of every state are written
constexpr std::uint64_t qdd_seed = 1987;  // of accelerations, apart from those of the states

struct Options {
  std::string scene, stress, states, folder, rounded = "float32";
  LoadOptions read;
  double value = 1;
  int random = 8;
  std::uint64_t seed = 1;
};

struct Asked {
  State state;
  VectorX<double> qdd;  // of inverse dynamics
};

struct Answers {
  MatrixX<Real> M, X;
  VectorX<Real> a, tau;
  MatrixX<Real> da;  // nv x 2 nv, by q and qd; empty unless `differentiable`
};

template <class Vector>
json numbers(const Vector& x) {
  json out = json::array();
  for (Eigen::Index i = 0; i < x.size(); ++i) out.push_back(static_cast<double>(x[i]));
  return out;
}

json rest(const VectorX<Real>& x) {
  return numbers(VectorX<Real>(x - x.cast<double>().cast<Real>()));
}

json rows(const MatrixX<Real>& X) {
  json out = json::array();
  for (Eigen::Index i = 0; i < X.rows(); ++i) out.push_back(numbers(X.row(i)));
  return out;
}

VectorX<double> rounded(const VectorX<double>& x) { return x.cast<float>().cast<double>(); }

Model<double> without_armature(Model<double> model) {
  for (int k = 0; k < model.nv(); ++k) model.set_noise(k, 0.0);
  return model;
}

bool has_armature(const Model<double>& model) {
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).r > 0) return true;
  return false;
}

bool differentiable(const Model<double>& model) {
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).coordinate == Coordinate::quaternion) return false;
  return true;
}

// (1)
MatrixX<Real> derivatives(const Model<Real>& model, const Asked& asked, const Answers& exact,
                          unsigned digits) {
  const int nv = model.nv();
  const VectorX<Real> q = asked.state.q.cast<Real>(), qd = asked.state.qd.cast<Real>();
  const auto torque = [&](int k, const Real& dq, const Real& dqd) {
    VectorX<Real> q_at = q, qd_at = qd;
    q_at[model.joint(k).q_index] += dq;
    qd_at[k] += dqd;
    return WorldMechanics<Real>(model, q_at).torque(qd_at, exact.a, model.gravity());
  };
  const Real h = pow(Real(10), -static_cast<int>(digits / 3));
  MatrixX<Real> dt(nv, 2 * nv);
  for (int k = 0; k < nv; ++k) {
    dt.col(k) = (torque(k, h, 0) - torque(k, Real(-h), 0)) / Real(2 * h);
    dt.col(nv + k) = (torque(k, 0, 1) - torque(k, 0, -1)) / Real(2);
  }
  return -exact.X * dt;
}

Answers answers(const Model<double>& model, const Asked& asked, const std::string& where) {
  Truth<double> exact;
  try {
    exact =
        cached_truth<double>(model, asked.state.q, {Task<double>{asked.state.tau, asked.state.qd}});
  } catch (const std::runtime_error& e) {
    throw InputError(where + ": " + e.what());
  }
  if (!exact.outcome)
    throw InputError(where + ": singular mechanism: joint '" + model.name(exact.outcome.joint) +
                     "' moves no inertia");
  const Digits digits(exact.digits);
  const Model<Real> real = model.cast<Real>();
  const WorldMechanics<Real> mechanics(real, asked.state.q.cast<Real>());
  Answers out{exact.M,
              exact.X,
              exact.responses[0].a,
              mechanics.torque(asked.state.qd.cast<Real>(), asked.qdd.cast<Real>(), real.gravity()),
              {}};
  if (differentiable(model)) out.da = derivatives(real, asked, out, exact.digits);
  return out;
}

json to_json(const Answers& exact) {
  json out = {{"mass", rows(exact.M)},
              {"inverse", rows(exact.X)},
              {"acceleration", numbers(exact.a)},
              {"acceleration_rest", rest(exact.a)},
              {"inverse_dynamics", numbers(exact.tau)},
              {"inverse_dynamics_rest", rest(exact.tau)}};
  if (exact.da.size() > 0) out["derivatives"] = rows(exact.da);
  return out;
}

// Of the truth of other parameters, taken as computed.
json distance(const Answers& of, const Answers& from) {
  const VectorX<Real> dtau = of.tau - from.tau;
  json out = {{"mass", matrix_error(of.M, from.M).scaled},
              {"inverse", matrix_error(of.X, from.X).scaled},
              {"acceleration", acceleration_error(of.a, from.a, from.M).relative},
              {"inverse_dynamics", quotient<Real>(dtau.norm(), from.tau.norm())}};
  if (const Eigen::Index nv = of.X.rows(); of.da.size() > 0) {
    const auto block = [&](auto&& x, auto&& y) { return quotient<Real>((x - y).norm(), y.norm()); };
    out["derivatives"] =
        std::max({block(of.da.leftCols(nv), from.da.leftCols(nv)),
                  block(of.da.rightCols(nv), from.da.rightCols(nv)), block(of.X, from.X)});
  }
  return out;
}

// The joints of the files, each with its DoF and entries of q.
json joints_of(const Model<double>& model) {
  json out = json::array();
  for (int k = 0; k < model.nv();) {
    const auto [type, dofs] = file_joint(model.joint(k));
    out.push_back({{"name", model.name(k).substr(0, model.name(k).find(':'))},
                   {"type", type},
                   {"dof", k},
                   {"q", model.joint(k).q_index},
                   {"armature", model.joint(k).r}});
    k += dofs;
  }
  return out;
}

Model<double> stressed(const Scene& scene, const Options& options) {
  if (options.stress.empty()) return scene.model;
  std::string known;
  for (const limits::Stress& stress : limits::stresses_of(scene)) {
    if (stress.name == options.stress) return stress.model(options.value);
    known += (known.empty() ? "" : ", ") + stress.name;
  }
  throw InputError(scene.name + " has no stress '" + options.stress + "'; it has " + known);
}

std::vector<Asked> states_of(const Scene& scene, const Options& options) {
  const std::vector<State> given = options.states.empty()
                                       ? random_states(scene, options.random, options.seed)
                                       : read_states(scene, options.states).states;
  // Accelerations are N(0, 1), as torques of states are.
  const std::vector<State> drawn =
      random_states(scene, static_cast<int>(given.size()), options.seed + qdd_seed);
  std::vector<Asked> out;
  for (std::size_t i = 0; i < given.size(); ++i)
    out.push_back({{rounded(given[i].q), rounded(given[i].qd), rounded(given[i].tau)},
                   rounded(drawn[i].tau)});
  return out;
}

int run(const Options& options) {
  const Scene scene = open_scene(options.scene, options.read);
  if (scene.model.nv() > largest)
    throw InputError("scene '" + options.scene + "' has " + std::to_string(scene.model.nv()) +
                     " degrees of freedom; mechanisms of up to " + std::to_string(largest) +
                     " are written");
  const Model<double> given = stressed(scene, options);
  std::error_code error;
  std::filesystem::create_directories(options.folder, error);
  const std::filesystem::path folder = options.folder;
  OutputFile mjcf((folder / "robot.xml").string()), urdf((folder / "robot.urdf").string()),
      truth((folder / "truth.json").string());

  const bool rounds = options.rounded == "float32";
  const Model<double> model = rounds ? given.cast<float>().cast<double>() : given;
  const bool loaded = has_armature(model);
  std::string why_not;
  const std::optional<UrdfText> text = to_urdf(model, "robot", why_not);
  json document = {{"robot", scene.name},
                   {"nv", model.nv()},
                   {"nq", model.nq()},
                   {"rounded", options.rounded},
                   {"stress", options.stress},
                   {"value", options.value},
                   {"gravity", numbers(model.gravity())},
                   {"dofs", model.names()},
                   {"joints", joints_of(model)},
                   {"urdf", text ? json{{"left_out", text->left_out}} : json{{"not", why_not}}},
                   {"states", json::array()}};
  const std::vector<Asked> states = states_of(scene, options);
  Progress progress(static_cast<int>(states.size()));
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::string where = scene.name + ": state " + std::to_string(i);
    progress.step(where);
    const Asked& asked = states[i];
    const Answers exact = answers(model, asked, where);
    json entry = {{"qpos", numbers(asked.state.q)},
                  {"qvel", numbers(asked.state.qd)},
                  {"tau", numbers(asked.state.tau)},
                  {"qacc", numbers(asked.qdd)},
                  {"truth", to_json(exact)}};
    if (rounds) entry["rounding"] = distance(exact, answers(given, asked, where));
    if (loaded) entry["without_armature"] = to_json(answers(without_armature(model), asked, where));
    document["states"].push_back(std::move(entry));
  }
  mjcf.write(to_mjcf(model, "robot"));
  if (text) urdf.write(text->text);
  truth.write(document.dump() + "\n");
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app(
      "A scene as MJCF and URDF, with states that float32 holds and the true M, M^-1, "
      "accelerations "
      "and torques.",
      "export_mechanism");
  Options options;
  add_scene(app, options.scene, options.read)->required();
  app.add_option("--stress", options.stress, "one of those of limits, such as payload");
  app.add_option("--value", options.value, "of the stress")->capture_default_str();
  auto* file = app.add_option("--states", options.states, "JSON file with qpos, qvel and tau");
  app.add_option("--random", options.random, "number of random states")
      ->check(number_of_states())
      ->capture_default_str()
      ->excludes(file);
  app.add_option("--seed", options.seed, "of the random states and of accelerations")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--rounded", options.rounded, "precision that parameters are rounded to")
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  app.add_option("--out", options.folder, "folder for the files")->required();
  return run_program(app, argc, argv, [&] { return run(options); });
}
