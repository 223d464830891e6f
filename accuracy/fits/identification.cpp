#include "accuracy/fits/identification.hpp"

#include <algorithm>

#include "accuracy/fits/identifiability.hpp"
#include "accuracy/fits/start.hpp"
#include "accuracy/programs/open_scene.hpp"
#include "robots/fitted_model.hpp"

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

bool judge(Identification& it) {
  it.before = torque_error(it.start, it.test);
  if (!it.fit.usable) return false;
  it.after = torque_error(it.fit.robot, it.test);
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
