#include "robots/scene/fitted_model.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "algorithms/spatial/principal_axes.hpp"
#include "robots/loader/files/read_file.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/mujoco_strip.hpp"

namespace kalmarm {
namespace {

constexpr double tolerance = 1e-9;  // of what is read again, relative

// M as a rigid body in the axes of a frame that stands at `frame` in M's. Throws InputError where
// no mass distribution has such an inertia.
RigidBody<double> seen_from(const LinkFrame& frame, const SpatialInertia<double>& M,
                            const std::string& joint) {
  const Vector3<double> com = M.m > 0 ? Vector3<double>(M.h / M.m) : Vector3<double>::Zero();
  const Matrix3<double> E = rotation(frame.R);
  const Matrix3<double> I_cm = M.I + cross_matrix(M.h) * cross_matrix(com);
  RigidBody<double> body =
      with_principal_axes<double>(M.m, E.transpose() * (com - frame.p), E.transpose() * I_cm * E);
  Vector3<double>& J = body.moments;
  const double rounding = 1e-12 * M.I.trace();
  if (!(M.m >= 0 && std::isfinite(M.m) && M.h.allFinite() && J[0] >= -rounding &&
        J[2] <= J[0] + J[1] + rounding))
    throw InputError("link of joint '" + joint +
                     "': no mass distribution has this inertia (its pseudo-inertia is not positive "
                     "semidefinite)");
  J = J.cwiseMax(0.0);
  J[2] = std::min(J[2], J[0] + J[1]);  // a flat body's, to the last digit
  return body;
}

void set_inertia(mjsBody* body, const RigidBody<double>& inertia) {
  body->explicitinertial = 1;
  body->mass = inertia.mass;
  Eigen::Map<Vector3<double>>(body->ipos) = inertia.com;
  body->ialt.type = mjORIENTATION_QUAT;
  const Eigen::Quaternion<double>& axes = inertia.axes;
  Eigen::Map<Eigen::Vector4d>(body->iquat) << axes.w(), axes.x(), axes.y(), axes.z();
  Eigen::Map<Vector3<double>>(body->inertia) = inertia.moments;
  body->fullinertia[0] = std::numeric_limits<double>::quiet_NaN();  // not given
}

RigidBody<double> compiled_inertia(const mjModel* m, int body) {
  const mjtNum *com = m->body_ipos + 3 * body, *axes = m->body_iquat + 4 * body,
               *moments = m->body_inertia + 3 * body;
  return {m->body_mass[body],
          {com[0], com[1], com[2]},
          {axes[0], axes[1], axes[2], axes[3]},
          {moments[0], moments[1], moments[2]}};
}

// The free joint of a body whose axes MuJoCo's compiler turns into its principal ones; null where
// it does not.
mjsJoint* aligning_joint(const mjSpec* spec, mjsBody* body) {
  mjsElement* e = mjs_firstChild(body, mjOBJ_JOINT, 0);
  if (!e || mjs_firstChild(body, mjOBJ_BODY, 0)) return nullptr;
  mjsJoint* joint = mjs_asJoint(e);
  const bool aligned = joint->align == mjALIGNFREE_TRUE ||
                       (joint->align == mjALIGNFREE_AUTO && spec->compiler.alignfree);
  return joint->type == mjJNT_FREE && aligned ? joint : nullptr;
}

// Every body that moves gets its inertia in words, and the compiler's options that would change it
// are off.
void set_inertias(mjSpec* spec, const MujocoModel& compiled, const Model<double>& model,
                  const FittedParameters& fitted) {
  spec->compiler.boundmass = spec->compiler.boundinertia = 0;
  spec->compiler.settotalmass = -1;
  spec->compiler.inertiafromgeom = mjINERTIAFROMGEOM_AUTO;
  const std::vector<LinkFrame> frames = compiled.body_frames();
  const auto carrier = [&](int link) {  // welded bodies come after the one that has the joint
    const auto found = std::find_if(frames.begin(), frames.end(),
                                    [&](const LinkFrame& frame) { return frame.link == link; });
    return static_cast<int>(found - frames.begin());
  };
  for (const auto& [link, M] : fitted.inertia)
    if (carrier(link) == static_cast<int>(frames.size()))
      throw InputError("joint '" + model.name(link) + "' has no body of its own");

  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    const int id = mjs_getId(e);
    const int link = frames[id].link;
    if (link < 0) continue;
    const auto found = fitted.inertia.find(link);
    mjsBody* body = mjs_asBody(e);
    if (mjsJoint* joint = aligning_joint(spec, body)) {
      if (found != fitted.inertia.end())
        throw InputError("link of joint '" + model.name(link) +
                         "': its axes are aligned with its " +
                         "inertia (alignfree), which cannot change");
      joint->align = mjALIGNFREE_TRUE;
      continue;
    }
    set_inertia(body, found == fitted.inertia.end() ? compiled_inertia(compiled.get(), id)
                      : id == carrier(link) ? seen_from(frames[id], found->second, model.name(link))
                                            : RigidBody<double>());
  }
  spec->compiler.alignfree = 0;  // MuJoCo does not write that a joint is an exception
}

// What all DoF of a joint have in common; nothing where it is not given.
std::optional<double> common(const std::map<int, double>& values, int first, int count,
                             const char* what, const Model<double>& model) {
  const auto begin = values.lower_bound(first), end = values.lower_bound(first + count);
  if (begin == end) return std::nullopt;
  const double value = begin->second;
  const std::string name = "joint '" + model.name(first) + "'";
  if (!(value >= 0 && std::isfinite(value)))
    throw InputError(name + ": " + what + " " + std::to_string(value) + " must not be negative");
  if (std::distance(begin, end) != count ||
      std::any_of(begin, end, [&](const auto& entry) { return entry.second != value; }))
    throw InputError(name + ": MuJoCo has one " + what + " for all of its axes");
  return value;
}

void set_joints(mjSpec* spec, const mjModel* m, const Model<double>& model,
                const FittedParameters& fitted) {
  for (mjsElement* e : elements(spec, mjOBJ_JOINT)) {
    mjsJoint* joint = mjs_asJoint(e);
    const int id = mjs_getId(e), first = m->jnt_dofadr[id];
    const int count = static_cast<int>(std::count(m->dof_jntid, m->dof_jntid + m->nv, id));
    if (joint->springdamper[0] > 0) {  // which MuJoCo turns into numbers by means of the inertia
      linear(joint->stiffness) = m->jnt_stiffness[id];
      linear(joint->damping) = m->dof_damping[first];
      std::fill(joint->springdamper, joint->springdamper + 2, 0.0);
    }
    if (const auto r = common(fitted.armature, first, count, "armature", model)) {
      joint->armature = *r;
      for (mjsElement* a : elements(spec, mjOBJ_ACTUATOR))
        if (m->actuator_trnid[2 * mjs_getId(a)] == id &&
            m->actuator_trntype[mjs_getId(a)] == mjTRN_JOINT)
          mjs_asActuator(a)->armature = 0;
    }
    if (const auto d = common(fitted.viscous, first, count, "damping", model))
      linear(joint->damping) = *d;
    if (const auto c = common(fitted.coulomb, first, count, "frictionloss", model))
      joint->frictionloss = *c;
  }
}

// Meshes and textures are found from wherever the text will be.
void make_folders_absolute(mjSpec* spec, const std::string& robot_file) {
  const std::filesystem::path folder = std::filesystem::absolute(robot_file).parent_path();
  const auto make_absolute = [&](mjString* to) {
    mjs_setString(to, (folder / mjs_getString(to)).lexically_normal().string().c_str());
  };
  const auto has = [&](mjtObj type) { return mjs_firstElement(spec, type) != nullptr; };
  if (has(mjOBJ_MESH) || has(mjOBJ_HFIELD) || has(mjOBJ_SKIN))
    make_absolute(spec->compiler.meshdir);
  if (has(mjOBJ_TEXTURE)) make_absolute(spec->compiler.texturedir);
}

// XML has no "--" within a comment and no "-" at its end.
std::string comment(std::string text) {
  for (std::size_t at; (at = text.find("--")) != std::string::npos;) text.insert(at + 1, 1, ' ');
  if (text.ends_with('-')) text += ' ';
  return text;
}

std::string to_xml(mjSpec* spec, const std::string& robot_file) {
  const AllDigits digits;
  char error[1024] = "";
  std::string text(1 << 16, '\0');
  int size =
      mj_saveXMLString(spec, text.data(), static_cast<int>(text.size()), error, sizeof error);
  if (size > 0) {
    text.resize(size + 1);
    size = mj_saveXMLString(spec, text.data(), static_cast<int>(text.size()), error, sizeof error);
  }
  if (size != 0) throw InputError(robot_file + ": cannot be saved: " + error);
  text.resize(text.find('\0'));
  return text;
}

// True where the same robot was read, with these parameters.
bool same(const Model<double>& a, const Model<double>& b) {
  if (a.nv() != b.nv()) return false;
  for (int k = 0; k < a.nv(); ++k) {
    const SpatialInertia<double>&M = a.M(k), &N = b.M(k);
    const double inertia = M.I.trace(), length = a.joint(k).translation.norm() + 1;
    if (a.parent(k) != b.parent(k) || !(std::abs(M.m - N.m) <= tolerance * M.m) ||
        !((M.h - N.h).norm() <= tolerance * std::sqrt(M.m * inertia)) ||
        !((M.I - N.I).norm() <= tolerance * inertia) ||
        !(std::abs(a.joint(k).r - b.joint(k).r) <= tolerance * a.joint(k).r) ||
        !((a.E(k) - b.E(k)).norm() <= tolerance) ||
        !((a.joint(k).translation - b.joint(k).translation).norm() <= tolerance * length))
      return false;
  }
  return true;
}

void check(const std::string& text, const Model<double>& wanted, const FittedParameters& fitted,
           const std::string& robot_file) {
  char error[1024] = "";
  const SpecPtr spec(mj_parseXMLString(text.c_str(), nullptr, error, sizeof error), mj_deleteSpec);
  if (!spec) throw InputError(robot_file + ": what was saved is not read: " + error);
  strip(spec.get());
  const auto read = compile(spec.get(), robot_file + ": what was saved");
  bool good = same(wanted, read->lower());
  for (const auto& [k, d] : fitted.viscous) good &= read->get()->dof_damping[k] == d;
  for (const auto& [k, c] : fitted.coulomb) good &= read->get()->dof_frictionloss[k] == c;
  if (!good) throw InputError(robot_file + ": MuJoCo does not hold the fitted parameters");
}

}  // namespace

std::string save_fitted(const std::string& robot_file, const FittedParameters& fitted,
                        const std::string& note, const LoadOptions& read) {
  Model<double> wanted = MujocoModel::load(robot_file, read)->lower();
  for (const auto& [k, M] : fitted.inertia) wanted.set_inertia(k, M);
  for (const auto& [k, r] : fitted.armature) wanted.set_noise(k, r);

  SpecPtr spec = read_file(robot_file, read).spec;
  std::shared_ptr<const MujocoModel> compiled;
  try {
    compiled = compile(spec.get(), robot_file);
  } catch (const InputError&) {  // load() compiled it without what is missing
    spec = read_file(robot_file, read).spec;
    strip(spec.get());
    compiled = compile(spec.get(), robot_file);
  }
  try {
    set_inertias(spec.get(), *compiled, wanted, fitted);
    set_joints(spec.get(), compiled->get(), wanted, fitted);
  } catch (const InputError& e) {
    throw InputError(robot_file + ": " + e.what());
  }
  make_folders_absolute(spec.get(), robot_file);
  const std::string before = mjs_getString(spec->comment);
  mjs_setString(spec->comment, comment(before.empty() ? note : note + '\n' + before).c_str());
  compile(spec.get(), robot_file);  // MuJoCo saves what it has compiled

  std::string text = to_xml(spec.get(), robot_file);
  check(text, wanted, fitted, robot_file);
  return text;
}

}  // namespace kalmarm
