#include "accuracy/fits/identification.hpp"

#include <algorithm>
#include <cstdio>

#include "accuracy/fits/friction_left.hpp"
#include "accuracy/fits/identifiability.hpp"
#include "accuracy/fits/start.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "robots/loader/names.hpp"
#include "robots/scene/fitted_model.hpp"

namespace kalmarm {
namespace {

void check(const IdentificationOptions& options, const Scene& scene) {
  if (options.data.empty() == options.hidden.empty())
    throw InputError("one of --data and --simulate is needed, and not both");
  if (options.fit.residual == Residual::mass_matrix && options.hidden.empty())
    throw InputError("--residual mass_matrix: mass matrices are known only with --simulate");
  if (!options.out.empty() && scene.file.empty())
    throw InputError("--out: " + scene.name + " has no file that could be written again");
}

// Bodies that "bodies" leaves out.
void note_held_bodies(const IdentificationOptions& options, const Identification& it) {
  if (std::find(options.free.begin(), options.free.end(), "bodies") == options.free.end()) return;
  for (int k = 0; k < it.scene.model.nv(); ++k)
    if (!it.scene.model.inertia(k).massless &&
        std::find(it.free.bodies.begin(), it.free.bodies.end(), k) == it.free.bodies.end())
      add_note(options.robot + ": body '" + it.bodies[k] + "' is not physical and not fitted");
}

void simulate(const IdentificationOptions& options, Identification& it) {
  const Scene hidden = open_scene(options.hidden, options.read);
  it.truth = mechanics_of(hidden);
  check_same_joints(it.scene, hidden);
  check_physical(*it.truth, it.free, it.bodies, hidden.name);
  const SimulatedSamples simulated = simulate_samples(hidden, options.simulation);
  it.train = simulated.train;
  it.test = simulated.test;
}

// What the data lack: accelerations, or velocities too.
void complete(const IdentificationOptions& options, const Model<double>& model, Samples& samples) {
  try {
    if (!samples.has_velocities()) {
      differentiate_positions(samples, model, options.filter);
      add_note(options.data + ": no velocities: positions are differentiated, and the first and " +
               "last " + std::to_string(options.filter.half_width) + " samples left out");
    } else if (!samples.has_accelerations()) {
      differentiate(samples, options.filter);
    }
  } catch (const InputError& e) {
    throw InputError(options.data + ": " + e.what());
  }
}

void read(const IdentificationOptions& options, Identification& it) {
  Samples all = read_samples(it.scene, options.data);
  complete(options, it.scene.model, all);
  const int held_out = static_cast<int>(options.hold_out * all.count());
  if (all.count() - held_out < 1 || held_out < 1)
    throw InputError(options.data + ": " + std::to_string(all.count()) +
                     " samples are too few to hold some out");
  it.train = part(all, 0, all.count() - held_out);
  it.test = part(all, all.count() - held_out, held_out);
}

// What is not free is known: "no armature" where it is zero.
std::vector<std::string> known_parts(const Identification& it) {
  const int nv = it.scene.model.nv();
  std::vector<std::string> out;
  const auto held = [&](const std::vector<int>& free, const auto& has) {
    int count = 0;
    for (int k = 0; k < nv; ++k)
      count += has(k) && std::find(free.begin(), free.end(), k) == free.end();
    return count;
  };
  const int bodies =
      held(it.free.bodies, [&](int k) { return !it.scene.model.inertia(k).massless; });
  if (bodies > 0) out.push_back("inertia of " + counted(bodies, "body"));
  const auto add = [&](const std::vector<int>& free, const std::string& what, const auto& value) {
    if (!free.empty()) return;  // of all DoF or of none
    const int count = held(free, [&](int k) { return value(k) != 0; });
    out.push_back(count == 0 ? "no " + what : what + " of " + counted(count, "degree of freedom"));
  };
  add(it.free.armature, "armature", [&](int k) { return it.start.model.joint(k).r; });
  add(it.free.viscous, "viscous friction", [&](int k) { return it.start.viscous[k]; });
  add(it.free.coulomb, "Coulomb friction", [&](int k) { return it.start.coulomb[k]; });
  return out;
}

// The largest number of the data, and of their squares sums are made.
bool holds_absurd_numbers(Identification& it) {
  constexpr double absurd = 1e30;
  double largest = 0;
  for (const Samples* samples : {&it.train, &it.test})
    for (const MatrixX<double>* part : {&samples->q, &samples->qd, &samples->qdd, &samples->tau})
      largest = std::max(largest, part->cwiseAbs().maxCoeff());
  if (largest <= absurd) return false;
  char text[120];
  std::snprintf(text, sizeof text, "not fitted: the data hold a number of size %.3g, above %.0e",
                largest, absurd);
  it.findings.emplace_back(text);
  return true;
}

std::string names_of(const std::vector<int>& dofs, const Model<double>& model) {
  std::string out;
  for (const int k : dofs) out += (out.empty() ? "'" : ", '") + model.name(k) + "'";
  return out;
}

// What to free where the torques that are left look like friction, if it is not free.
void look_for_friction(Identification& it) {
  std::string free;
  if (it.free.viscous.empty()) free = "viscous";
  if (it.free.coulomb.empty()) free += (free.empty() ? "" : ",") + std::string("coulomb");
  if (free.empty()) return;
  const auto tell = [&](const std::vector<int>& dofs, const char* amount) {
    if (!dofs.empty())
      it.findings.push_back(std::string("the torque residual looks like ") + amount +
                            " friction than the robot has at " + names_of(dofs, it.scene.model) +
                            ": free it (--free bodies," + free + ")");
  };
  const FrictionLeft left = friction_left(it.fit.usable ? it.fit.robot : it.start, it.train);
  tell(left.missing, "more");
  tell(left.excessive, "less");
}

bool sees_a_parameter(const Identification& it) {
  return rank_and_condition(it.fit.R * column_units(it.start, it.free).asDiagonal()).rank > 0;
}

bool judge(Identification& it) {
  it.before = torque_error(it.start, it.test);
  look_for_friction(it);
  if (!it.fit.usable) return false;
  it.after = torque_error(it.fit.robot, it.test);
  if (!sees_a_parameter(it)) {
    it.findings.emplace_back("the data see no parameter");
    return false;
  }
  return it.after.total <= 1.1 * it.before.total + 1e-6;  // a start that is right is as good
}

}  // namespace

Identification identify(const IdentificationOptions& options) {
  Identification it;
  it.scene = open_scene(options.robot, options.read);
  check(options, it.scene);
  for (int k = 0; k < it.scene.model.nv(); ++k) it.bodies.push_back(link_name(it.scene, k));
  it.free = free_parameters(options.free, it.scene.model, it.bodies);
  note_held_bodies(options, it);
  if (it.free.columns() == 0) throw InputError("--free: nothing is left to fit");
  it.names = column_names(it.free, it.bodies, it.scene.model.names());
  it.start = mechanics_of(it.scene);
  if (!options.hidden.empty()) simulate(options, it);
  if (!options.data.empty()) read(options, it);
  check_physical(it.start, it.free, it.bodies, it.scene.name);
  if (options.start_error > 0)
    spoil(it.free, options.start_error, options.simulation.seed, it.start);
  it.known = known_parts(it);
  if (holds_absurd_numbers(it)) return it;
  it.fit = fit(it.start, it.free, it.train, options.fit);
  it.usable = judge(it);
  return it;
}

std::string fitted_file(const Identification& done, const std::string& note) {
  const Mechanics<double>& robot = done.fit.robot;
  FittedParameters fitted;
  for (const int k : done.free.bodies) fitted.inertia[k] = robot.model.M(k);
  for (const int k : done.free.armature) fitted.armature[k] = robot.model.joint(k).r;
  for (const int k : done.free.viscous) fitted.viscous[k] = robot.viscous[k];
  for (const int k : done.free.coulomb) fitted.coulomb[k] = robot.coulomb[k];
  return save_fitted(done.scene.file, fitted, note, done.scene.read);
}

}  // namespace kalmarm
