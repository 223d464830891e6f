// compare_files: what our loader makes of a file against MuJoCo's own load of it, untouched.
//
// At random states M and a of the scene (Dynamics<double>) are compared with the mass matrix and
// the bias of MuJoCo's model, without its constraints, contacts, actuators and passive forces:
//   mass          max |M_ij - M0_ij| / sqrt(M0_ii M0_jj), without DoF whose M0_ii is rounding
//   acceleration  |a - a0| / |a0|, a0 by MuJoCo's factors of M0; it errs by them too
//   residual      max_k |M0 a + bias0 - tau|_k / (|M0| |a| + |bias0| + |tau|)_k
// Of a file that MuJoCo refuses, or that options make another robot of, its model of what we read of it
// stands in: that checks the lowering to our own model alone. The JSON has "ours" and "mujoco", the
// reason where one of them has not loaded the file, else null. Exit 1 where we load it and the two differ by more than the bounds.
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/model/plain.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/scene/file_options.hpp"
#include "robots/scene/mujoco_solver.hpp"
#include "robots/scene/scene.hpp"
#include "robots/scene/untouched.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

// MuJoCo takes moments about a tree's centre of mass, in which light links far from it lose digits:
// its M of Pepper's fingers errs by 1e-10 of M in multi-precision, ours by 4e-16. A residual has the
// cancellation of bias terms too.
struct Bounds {
  double mass = 1e-9, residual = 1e-8;
};
// MuJoCo takes an inertia's frame for the body's where they are less than 1e-6 apart, and so leaves
// out what that distance adds to M; where an acceleration is small, the residual shows it more.
constexpr Bounds merged_frames{1e-6, 1e-3};

// True where MuJoCo has taken two frames for one that are not.
bool merges_frames(const mjModel* m) {
  for (int body = 1; body < m->nbody; ++body) {
    const mjtNum *p = m->body_ipos + 3 * body, *q = m->body_iquat + 4 * body;
    const bool turned = q[1] != 0 || q[2] != 0 || q[3] != 0;
    const bool moved = p[0] != 0 || p[1] != 0 || p[2] != 0;
    if (m->body_sameframe[body] == mjSAMEFRAME_BODY && (turned || moved)) return true;
    if (m->body_sameframe[body] == mjSAMEFRAME_BODYROT && turned) return true;
  }
  return false;
}

// A NaN stays.
void raise(double& most, double value) {
  if (!(value <= most || std::isnan(most))) most = value;
}

struct Difference {
  double mass = 0, acceleration = 0, residual = 0;
  int compared = 0;  // states of which both gave an acceleration
};

void add(const State& state, MujocoSolver& theirs, Dynamics<double>& ours, Difference& out) {
  const int nv = ours.nv();
  MatrixX<double> M(nv, nv), M0(nv, nv);
  VectorX<double> a(nv), a0(nv), tau(nv), bias(nv);
  theirs.mass(state.q, M0);
  ours.mass(state.q, M);
  const auto diagonal = M0.diagonal().array();
  // A diagonal entry that is zero but for rounding has no digits that could be compared.
  constexpr double roundings = 100;  // MuJoCo's, about a centre of mass that is elsewhere
  const double nothing = roundings * unit_roundoff<double>() *
                         (M.diagonal().isZero(0) ? 1 : diagonal.maxCoeff());  // [kg m^2]
  const VectorX<double> size =
      (diagonal > nothing).select(diagonal.sqrt(), std::numeric_limits<double>::infinity());
  raise(out.mass, ((M - M0).array() / (size * size.transpose()).array()).abs().maxCoeff());
  const Outcome mine = ours.forward_dynamics(state.q, state.qd, state.tau, a);
  const Outcome yours = theirs.acceleration(state.q, state.qd, state.tau, a0);
  if (!mine || !yours) return;
  ++out.compared;
  theirs.inverse_dynamics(state.q, state.qd, a, tau);
  theirs.inverse_dynamics(state.q, state.qd, VectorX<double>::Zero(nv), bias);
  const VectorX<double> scale =
      M0.cwiseAbs() * a.cwiseAbs() + bias.cwiseAbs() + state.tau.cwiseAbs();
  raise(out.residual, ((tau - state.tau).array() / scale.array()).abs().maxCoeff());
  raise(out.acceleration, (a - a0).norm() / a0.norm());
}

std::optional<Scene> load_ours(const std::string& path, const LoadOptions& read, json& reason) {
  try {
    return load_scene(path, read);
  } catch (const InputError& e) {
    reason = e.what();
  }
  return std::nullopt;
}

json compare(const std::string& path, const LoadOptions& read, int states, std::uint64_t seed) {
  json record{
      {"file", path}, {"mujoco", nullptr}, {"ours", nullptr}, {"mujoco_version", mujoco_version()}};
  const auto [original, reason] = load_untouched(path, read);
  if (!original) record["mujoco"] = reason;
  const std::optional<Scene> scene = load_ours(path, read, record["ours"]);
  if (original) record["mujoco_nv"] = static_cast<int>(original->get()->nv);
  if (scene) {
    record["nv"] = scene->model.nv();
    record["notes"] = scene->mujoco->notes();
  }
  if (!scene) return record;
  if (original &&
      (scene->model.nv() != original->get()->nv || scene->model.nq() != original->get()->nq))
    return record;
  Difference difference;
  record["merged_frames"] = original && merges_frames(original->get());
  MujocoSolver theirs(original ? original : scene->mujoco);
  Dynamics<double> ours(plain(scene->model));
  for (const State& state : random_states(*scene, states, seed))
    add(state, theirs, ours, difference);
  record["mass"] = difference.mass;
  record["compared"] = difference.compared;
  if (difference.compared == 0) return record;
  record["acceleration"] = difference.acceleration;
  record["residual"] = difference.residual;
  return record;
}

bool agrees(const json& record) {
  if (!record["ours"].is_null()) return true;
  if (!record.contains("mass")) return false;
  const Bounds bounds = record["merged_frames"] ? merged_frames : Bounds{};
  return record["mass"] <= bounds.mass &&
         (!record.contains("residual") || record["residual"] <= bounds.residual);
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("What the loader makes of a file against MuJoCo's own load of it.", "compare_files");
  std::string file, json_file = "-";
  int states = 10;
  std::uint64_t seed = 1;
  LoadOptions read;
  app.add_option("FILE", file, "MJCF or URDF file")->required()->check(CLI::ExistingFile);
  add_file_options(app, read);
  app.add_option("--random", states, "number of random states")
      ->check(between(1, 10000))
      ->capture_default_str();
  app.add_option("--seed", seed, "of the random states")->check(any_seed())->capture_default_str();
  app.add_option("--json", json_file, std::string("all results: ") + json_help)
      ->capture_default_str();
  return run_program(app, argc, argv, [&] {
    OutputFile out = json_output(json_file);
    const json record = compare(file, read, states, seed);
    out.write(record.dump(1) + "\n");
    return agrees(record) ? 0 : 1;
  });
}
