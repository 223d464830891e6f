#include "robots/loader/mujoco_model.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "robots/loader/constraints.hpp"
#include "robots/loader/files/given_inertia.hpp"
#include "robots/loader/files/ignored.hpp"
#include "robots/loader/files/read_file.hpp"
#include "robots/loader/imposed_rows.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/mujoco_strip.hpp"
#include "robots/loader/names.hpp"
#include "robots/loader/parts.hpp"
#include "robots/loader/tendons.hpp"

namespace kalmarm {
namespace {

// Throws InputError with `what` and MuJoCo's reason.
mjModel* compiled(mjSpec* spec, const std::string& what) {
  if (mjModel* model = mj_compile(spec, nullptr)) return model;
  throw InputError(what + ": " + std::string(mjs_getError(spec)));
}

// A file may hold parts that MuJoCo refuses and no robot needs: actuators, which are all muted then, and
// bodies that cannot move, whose mass settotalmass leaves out then. `notes` have the reasons.
mjModel* compiled_without_bad_parts(mjSpec* spec, const std::string& what,
                                    std::vector<Control>& controls, std::vector<std::string>& notes,
                                    bool takes_steps) {
  if (mjModel* model = mj_compile(spec, nullptr)) return model;
  if (!controls.empty()) {
    if (takes_steps)
      notes.push_back(one_line("ignored: all actuators, of which MuJoCo refuses one: " +
                               std::string(mjs_getError(spec))));
    for (const Control& control : controls) mute(mjs_asActuator(control.actuator));
    controls.clear();
    if (mjModel* model = mj_compile(spec, nullptr)) return model;
  }
  if (spec->compiler.settotalmass > 0) {
    notes.push_back(
        one_line("settotalmass without bodies that cannot move, of which MuJoCo refuses one: " +
                 std::string(mjs_getError(spec))));
    strip_inertias(spec, false);
  }
  return compiled(spec, what);
}

// M is singular in these joints; who locks them, asks for others or gives them armature is answered.
std::string note_of_joints_without_inertia(const Model<double>& model) {
  std::vector<bool> moves_inertia(model.nv());
  std::string joints;
  for (int k = model.nv() - 1; k >= 0; --k) {
    const Joint<double>& joint = model.joint(k);
    moves_inertia[k] = moves_inertia[k] || joint.r > 0 || !joint.body.massless();
    if (moves_inertia[k] && joint.parent >= 0) moves_inertia[joint.parent] = true;
  }
  for (int k = 0; k < model.nv(); ++k)
    if (!moves_inertia[k]) joints += (joints.empty() ? "'" : ", '") + model.name(k) + "'";
  return joints.empty() ? "" : "no inertia (option armature gives some) is moved by: " + joints;
}

// Of a compiled model from which all is taken that has no terms; refuses here what later calls could not
// hold.
std::shared_ptr<const MujocoModel> complete(std::unique_ptr<mjModel, void (*)(mjModel*)> model,
                                            std::vector<std::string> notes, Keyframe key,
                                            VectorX<double> controls,
                                            const std::vector<NamedCoupling>& imposed,
                                            bool takes_steps) {
  const int muted = mute_destabilising(model.get(), controls);
  if (muted > 0 && takes_steps)
    notes.push_back("ignored: " + counted(muted, "actuator with negative stiffness or damping"));
  if (model->nv == 0)
    throw InputError("no joint, so no degree of freedom (option floating gives the root one)");
  const std::string idle = note_of_joints_without_inertia(lowered(model.get()));
  if (!idle.empty()) notes.push_back(one_line(idle));
  auto out = std::make_shared<const MujocoModel>(model.release(), std::move(notes), std::move(key),
                                                 std::move(controls), imposed);
  out->actuators();
  if (takes_steps) check_tendons(out->get());
  out->ranges();
  return out;
}

std::string note_of(const std::vector<GivenInertia>& taken) {
  std::string bodies;
  for (const GivenInertia& given : taken)
    if (!given.given.massless() && !given.is_of_solid())
      bodies += (bodies.empty() ? "'" : ", '") + name_of(given.body->element) + "'";
  return bodies.empty()
             ? ""
             : "taken as given, although no solid body has such moments of inertia: " + bodies;
}

}  // namespace

std::shared_ptr<const MujocoModel> compile(mjSpec* spec, const std::string& what) {
  auto out = std::make_shared<const MujocoModel>(compiled(spec, what));
  if (out->get()->nv == 0) throw InputError(what + ": no joint, so no degree of freedom");
  return out;
}

void install_mujoco_handlers() {
  mju_user_error = [](const char* message) { throw InputError(std::string("MuJoCo: ") + message); };
  mju_user_warning = [](const char*) {};
}

MujocoModel::MujocoModel(mjModel* model, std::vector<std::string> notes, Keyframe key,
                         VectorX<double> controls, const std::vector<NamedCoupling>& imposed)
    : model_(model, mj_deleteModel),
      notes_(std::move(notes)),
      home_(completed(std::move(key), model)),
      controls_(std::move(controls)),
      imposed_(imposed_rows(static_cast<int>(model->nv), couplings_of(model, imposed))) {
  if (controls_.size() == 0) controls_ = VectorX<double>::Zero(actuator_count(model));
}

JointTerms MujocoModel::joint_terms() const {
  JointTerms out = kalmarm::joint_terms(get());
  out.rows.insert(out.rows.end(), imposed_.begin(), imposed_.end());
  return out;
}

std::shared_ptr<const MujocoModel> MujocoModel::load(const std::string& path,
                                                     const LoadOptions& options, Frames frames) {
  install_mujoco_handlers();
  auto [spec, notes, key, set] = read_file(path, options);
  try {
    const bool imposes = options.takes_steps && options.imposes_couplings;
    const std::vector<NamedCoupling> imposed =
        imposes ? linear_couplings(spec.get()) : std::vector<NamedCoupling>{};
    strip(spec.get(), frames, options);
    const std::vector<GivenInertia> taken = take_out_inertias(spec.get(), frames == Frames::kept);
    if (const std::string note = one_line(note_of(taken)); !note.empty()) notes.push_back(note);
    const std::vector<DampingRatio> ratios = damping_ratios(spec.get());
    std::unique_ptr<mjModel, void (*)(mjModel*)> model(
        compiled_without_bad_parts(spec.get(), path, set, notes, options.takes_steps),
        mj_deleteModel);
    put_back(taken, spec.get(), model.get());
    if (!taken.empty()) {  // what the compiler made of the balls
      const VectorX<double> M0 = diagonal_at_start(model.get());
      std::copy(M0.begin(), M0.end(), model->dof_M0);
      set_dampers(ratios, M0, model.get());
      if (model->neq > 0) weigh_constraints(model.get());
    }
    VectorX<double> controls = limited_controls(model.get(), set);
    return complete(std::move(model), std::move(notes), std::move(key), std::move(controls),
                    imposed, options.takes_steps);
  } catch (const InputError& e) {
    if (std::string(e.what()).starts_with(path)) throw;
    throw InputError(path + ": " + e.what());
  }
}

std::shared_ptr<const MujocoModel> MujocoModel::copy_of(const mjModel* given,
                                                        const VectorX<double>& ctrl,
                                                        const LoadOptions& options) {
  install_mujoco_handlers();
  std::unique_ptr<mjModel, void (*)(mjModel*)> model(mj_copyModel(nullptr, given), mj_deleteModel);
  const MovingParts parts = parts_of(model.get());
  refuse_coupling_armature(parts.actuators, parts.tendons, options.takes_steps);
  std::vector<std::string> notes;
  const std::string ignored = ignored_parts(parts, options);
  if (!ignored.empty()) notes.push_back(one_line("ignored: " + ignored));
  VectorX<double> controls = limited_controls(model.get(), parts.actuators, ctrl);
  for (std::size_t i = 0; i < parts.actuators.size(); ++i)
    if (!parts.actuators[i].left_out().empty()) mute(model.get(), static_cast<int>(i));
  return complete(std::move(model), std::move(notes), {}, std::move(controls), {},
                  options.takes_steps);
}

std::vector<std::array<double, 2>> MujocoModel::ranges() const {
  // [rad or m] A joint that may go further is taken as one without a limit: of a larger angle float64
  // tells no more than ten digits, and squares of lengths may overflow.
  constexpr double farthest = 1e6;
  const mjModel* m = get();
  std::vector<std::array<double, 2>> out(m->nq, {-1, 1});
  for (int j = 0; j < m->njnt; ++j) {
    if (!has_one_axis(m->jnt_type[j])) continue;
    std::array<double, 2>& range = out[m->jnt_qposadr[j]];
    const double reach = m->jnt_type[j] == mjJNT_HINGE ? std::numbers::pi : 0.5;
    range = {-reach, reach};
    const double low = m->jnt_range[2 * j], high = m->jnt_range[2 * j + 1];
    if (!m->jnt_limited[j]) continue;
    const char* name = mj_id2name(m, mjOBJ_JOINT, j);
    if (!std::isfinite(high - low))
      throw InputError("joint '" + std::string(name ? name : "") +
                       "': its range is wider than the largest number");
    if (std::max(-low, high) <= farthest) range = {low, high};
  }
  return out;
}

std::shared_ptr<const MujocoModel> MujocoModel::from(const Model<double>& model,
                                                     const std::string& name) {
  install_mujoco_handlers();
  const SpecPtr spec(mj_makeSpec(), mj_deleteSpec);
  spec->compiler.degree = 0;
  Eigen::Map<Eigen::Vector3d>(spec->option.gravity) = model.gravity();
  std::vector<mjsBody*> bodies;
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<double>& from = model.joint(k);
    mjsBody* body = mjs_addBody(
        from.parent < 0 ? mjs_findBody(spec.get(), "world") : bodies[from.parent], nullptr);
    bodies.push_back(body);
    const auto set_quat = [](double* to, const Eigen::Quaternion<double>& q) {
      to[0] = q.w(), to[1] = q.x(), to[2] = q.y(), to[3] = q.z();
    };
    mjs_setName(body->element, ("link" + std::to_string(k)).c_str());
    Eigen::Map<Eigen::Vector3d>(body->pos) = from.translation;
    set_quat(body->quat, from.rotation);
    body->explicitinertial = 1;
    body->mass = from.body.mass;
    Eigen::Map<Eigen::Vector3d>(body->ipos) = from.body.com;
    set_quat(body->iquat, from.body.axes);
    Eigen::Map<Eigen::Vector3d>(body->inertia) = from.body.moments;

    mjsJoint* joint = mjs_addJoint(body, nullptr);
    mjs_setName(joint->element, model.name(k).c_str());
    joint->type = from.slides ? mjJNT_SLIDE : mjJNT_HINGE;
    Eigen::Map<Eigen::Vector3d>(joint->axis) = Eigen::Vector3d::UnitZ();
    joint->ref = from.ref;
    joint->armature = from.r;
  }
  auto out = compile(spec.get(), name);
  for (int k = 0; k < model.nv(); ++k)
    if (out->get()->body_parentid[k + 1] != model.parent(k) + 1)
      throw InputError(name + ": MuJoCo numbers links depth first, this model does not");
  return out;
}

}  // namespace kalmarm
