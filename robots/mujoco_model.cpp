#include "robots/mujoco_model.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "robots/input_error.hpp"
#include "robots/mujoco_shim.hpp"

namespace kalmarm {
namespace {

using Quaternion = Eigen::Quaternion<double>;
using Vec3 = Vector3<double>;
using SpecPtr = std::unique_ptr<mjSpec, void (*)(mjSpec*)>;

std::string one_line(std::string text) {
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

std::vector<mjsElement*> elements(mjSpec* spec, mjtObj type) {
  std::vector<mjsElement*> out;
  for (mjsElement* e = mjs_firstElement(spec, type); e; e = mjs_nextElement(spec, e))
    out.push_back(e);
  return out;
}

std::string name_of(mjsElement* element) { return mjs_getString(mjs_getName(element)); }

// True where MuJoCo's compiler will take the body's inertia from its geoms.
bool inertia_from_geoms(const mjSpec* spec, const mjsBody* body) {
  switch (spec->compiler.inertiafromgeom) {
    case mjINERTIAFROMGEOM_FALSE:
      return false;
    case mjINERTIAFROMGEOM_TRUE:
      return true;
    default:
      return !body->explicitinertial;
  }
}

void refuse_coupling_armature(mjSpec* spec) {
  for (mjsElement* e : elements(spec, mjOBJ_TENDON))
    if (mjs_asTendon(e)->armature != 0)
      throw InputError("tendon '" + name_of(e) + "' has armature " +
                       std::to_string(mjs_asTendon(e)->armature) +
                       ", which couples joints in M: not supported");
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR)) {
    const mjsActuator* actuator = mjs_asActuator(e);
    if (actuator->armature != 0 && actuator->trntype != mjTRN_JOINT)
      throw InputError("actuator '" + name_of(e) + "' has armature " +
                       std::to_string(actuator->armature) +
                       " but does not drive a joint: not supported");
  }
}

// Bodies that cannot move need no inertia, and files often give them one that is none. Parents come
// before their children.
std::vector<const mjsBody*> strip_static_inertias(mjSpec* spec) {
  std::vector<const mjsBody*> fixed = {mjs_findBody(spec, "world")};
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    const bool moves = mjs_firstChild(body, mjOBJ_JOINT, 0) != nullptr;
    const mjsBody* parent = mjs_getParent(e);
    if (moves || std::find(fixed.begin(), fixed.end(), parent) == fixed.end()) continue;
    fixed.push_back(body);
    body->explicitinertial = 0;
    body->mass = 0;
    body->ipos[0] = body->fullinertia[0] = std::numeric_limits<double>::quiet_NaN();  // not given
    std::fill(body->inertia, body->inertia + 3, 0.0);
  }
  return fixed;
}

// Leaves in the spec what M and the bias depend on.
void strip(mjSpec* spec) {
  refuse_coupling_armature(spec);
  for (const mjtObj type : {mjOBJ_KEY, mjOBJ_SENSOR, mjOBJ_TUPLE, mjOBJ_NUMERIC, mjOBJ_TEXT,
                            mjOBJ_EXCLUDE, mjOBJ_PAIR, mjOBJ_EQUALITY})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR))
    if (mjs_asActuator(e)->armature == 0) mjs_delete(spec, e);
  for (const mjtObj type : {mjOBJ_TENDON, mjOBJ_SKIN, mjOBJ_CAMERA, mjOBJ_LIGHT, mjOBJ_SITE})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);

  const std::vector<const mjsBody*> fixed = strip_static_inertias(spec);
  std::vector<std::string> meshes;
  for (mjsElement* e : elements(spec, mjOBJ_GEOM)) {
    mjsGeom* geom = mjs_asGeom(e);
    const mjsBody* body = mjs_getParent(e);
    const bool is_fixed = std::find(fixed.begin(), fixed.end(), body) != fixed.end();
    if (is_fixed || !inertia_from_geoms(spec, body)) {
      mjs_delete(spec, e);
      continue;
    }
    mjs_setString(geom->material, "");
    geom->contype = geom->conaffinity = 0;
    meshes.push_back(mjs_getString(geom->meshname));
  }
  for (mjsElement* e : elements(spec, mjOBJ_MESH))
    if (std::find(meshes.begin(), meshes.end(), name_of(e)) == meshes.end())
      mjs_delete(spec, e);
    else
      mjs_setString(mjs_asMesh(e)->material, "");
  for (const mjtObj type : {mjOBJ_MATERIAL, mjOBJ_TEXTURE, mjOBJ_HFIELD})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);
}

std::shared_ptr<const MujocoModel> compile(mjSpec* spec, const std::string& what) {
  mjModel* model = mj_compile(spec, nullptr);
  if (!model) throw InputError(what + ": " + one_line(mjs_getError(spec)));
  auto out = std::make_shared<const MujocoModel>(model);
  if (model->nv == 0) throw InputError(what + ": no joint, so no degree of freedom");
  return out;
}

// A turn that takes e_z to `axis`; exact for the coordinate axes.
Quaternion turn_z_to(const Vec3& axis) {
  const Quaternion to_x(0.5, 0.5, 0.5, 0.5), to_y(0.5, -0.5, -0.5, -0.5), flip(0, 1, 0, 0);
  if (axis == Vec3(0, 0, 1)) return Quaternion::Identity();
  if (axis == Vec3(1, 0, 0)) return to_x;
  if (axis == Vec3(0, 1, 0)) return to_y;
  if (axis == Vec3(0, 0, -1)) return flip;
  if (axis == Vec3(-1, 0, 0)) return to_x * flip;
  if (axis == Vec3(0, -1, 0)) return to_y * flip;
  return Quaternion::FromTwoVectors(Vec3::UnitZ(), axis);
}

// Where a frame stands in the axes of a lowered link.
struct Frame {
  int link = -1;
  Quaternion R = Quaternion::Identity();
  Vec3 p = Vec3::Zero();

  Frame then(const Vec3& translation, const Quaternion& rotation) const {
    return {link, R * rotation, p + R * translation};
  }
};

// Two rigid bodies on one link become one.
RigidBody<double> welded(const RigidBody<double>& a, const RigidBody<double>& b) {
  if (a.massless()) return b;
  if (b.massless()) return a;
  RigidBody<double> out;
  out.mass = a.mass + b.mass;
  out.com = (a.mass * a.com + b.mass * b.com) / out.mass;
  Matrix3<double> I = Matrix3<double>::Zero();
  for (const RigidBody<double>* body : {&a, &b}) {
    const Matrix3<double> E = rotation(body->axes), d = cross_matrix<double>(body->com - out.com);
    I += E * body->moments.asDiagonal() * E.transpose() - body->mass * d * d;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3<double>> eigen(I);
  Matrix3<double> axes = eigen.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  out.axes = Quaternion(axes);
  out.moments = eigen.eigenvalues().cwiseMax(0.0);
  return out;
}

Vec3 vec3(const mjtNum* x) { return {x[0], x[1], x[2]}; }
Quaternion quat(const mjtNum* x) { return {x[0], x[1], x[2], x[3]}; }

class Lowering {
 public:
  explicit Lowering(const mjModel* m) : m_(m), frames_(m->nbody) {
    for (int body = 1; body < m->nbody; ++body) add_body(body);
  }

  // Throws InputError where the compiler let through what is no number or no inertia.
  Model<double> model() && {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const Joint<double>& joint = joints_[k];
      const RigidBody<double>& body = joint.body;
      const bool finite = joint.translation.allFinite() && joint.rotation.coeffs().allFinite() &&
                          body.com.allFinite() && body.axes.coeffs().allFinite() &&
                          std::isfinite(body.mass) && body.moments.allFinite() &&
                          std::isfinite(joint.ref) && std::isfinite(joint.r);
      if (!finite)
        throw InputError("joint '" + names_[k] + "' or its body: a number is not finite");
      if (joint.r < 0)
        throw InputError("joint '" + names_[k] + "' has armature " + std::to_string(joint.r) +
                         ": must not be negative");
    }
    return {std::move(joints_), std::move(names_), static_cast<int>(m_->nq), vec3(m_->opt.gravity)};
  }

 private:
  void add_body(int body) {
    Frame frame = frames_[m_->body_parentid[body]].then(vec3(m_->body_pos + 3 * body),
                                                        quat(m_->body_quat + 4 * body));
    for (int j = m_->body_jntadr[body]; j < m_->body_jntadr[body] + m_->body_jntnum[body]; ++j)
      frame = add_joint(j, frame);
    frames_[body] = frame;
    if (frame.link < 0) return;
    RigidBody<double> inertia;
    inertia.mass = m_->body_mass[body];
    inertia.com = frame.p + frame.R * vec3(m_->body_ipos + 3 * body);
    inertia.axes = frame.R * quat(m_->body_iquat + 4 * body);
    inertia.moments = vec3(m_->body_inertia + 3 * body);
    RigidBody<double>& link = joints_[frame.link].body;
    link = welded(link, inertia);
  }

  // Adds joint j to a body that stands at `frame` when the joint is at its reference; returns where
  // the body stands in the joint's last link.
  Frame add_joint(int j, const Frame& frame) {
    const Vec3 anchor = vec3(m_->jnt_pos + 3 * j);
    const int q = m_->jnt_qposadr[j];
    const char* given = mj_id2name(m_, mjOBJ_JOINT, j);
    const char* body = mj_id2name(m_, mjOBJ_BODY, m_->jnt_bodyid[j]);
    const std::string name =
        given ? given
              : (body ? body : "body" + std::to_string(m_->jnt_bodyid[j])) + std::string("_joint");
    switch (m_->jnt_type[j]) {
      case mjJNT_HINGE: {
        const Quaternion A = turn_z_to(vec3(m_->jnt_axis + 3 * j));
        const int link = add_dof(frame.then(anchor, A), false, Coordinate::angle, q, name);
        return Frame{link}.then(-(A.conjugate() * anchor), A.conjugate());
      }
      case mjJNT_SLIDE: {
        const Quaternion A = turn_z_to(vec3(m_->jnt_axis + 3 * j));
        const int link = add_dof(frame.then(Vec3::Zero(), A), true, Coordinate::distance, q, name);
        return Frame{link}.then(Vec3::Zero(), A.conjugate());
      }
      case mjJNT_BALL:
        return Frame{add_turns(frame.then(anchor, Quaternion::Identity()), q, name)}.then(
            -anchor, Quaternion::Identity());
      case mjJNT_FREE: {
        Frame at = frame;
        at.R = Quaternion::Identity();  // its q is the body's pose in the world
        at.p.setZero();
        const Quaternion C(0.5, 0.5, 0.5, 0.5);
        at = Frame{add_dof(at, true, Coordinate::position, q, name + ":x")};
        at = Frame{add_dof(at.then(Vec3::Zero(), C), true, Coordinate::follower, q, name + ":y")};
        at = Frame{add_dof(at.then(Vec3::Zero(), C), true, Coordinate::follower, q, name + ":z")};
        return Frame{add_turns(at, q + 3, name + ":r")};
      }
      default:
        throw InputError("joint '" + name + "' is of a type that is not supported");
    }
  }

  int add_turns(const Frame& at, int q, const std::string& name) {
    const Quaternion C(0.5, 0.5, 0.5, 0.5);
    int link = add_dof(at, false, Coordinate::quaternion, q, name + ":x");
    for (const char* axis : {":y", ":z"})
      link =
          add_dof(Frame{link}.then(Vec3::Zero(), C), false, Coordinate::follower, q, name + axis);
    return link;
  }

  int add_dof(const Frame& at, bool slides, Coordinate coordinate, int q, const std::string& name) {
    const int k = static_cast<int>(joints_.size());
    Joint<double> joint;
    joint.parent = at.link;
    joint.slides = slides;
    joint.coordinate = coordinate;
    joint.q_index = q;
    if (coordinate == Coordinate::angle || coordinate == Coordinate::distance)
      joint.ref = m_->qpos0[q];
    joint.rotation = at.R;
    joint.translation = at.p;
    joint.r = m_->dof_armature[k] + reflected_armature(m_->dof_jntid[k], name);
    joints_.push_back(joint);
    names_.push_back(name);
    return k;
  }

  // Armature of the actuators that drive a joint, as its own inertia feels it.
  double reflected_armature(int joint, const std::string& name) const {
    double sum = 0;
    for (int i = 0; i < actuator_count(m_); ++i) {
      if (m_->actuator_trnid[2 * i] != joint || m_->actuator_armature[i] == 0) continue;
      if (m_->jnt_type[joint] != mjJNT_HINGE && m_->jnt_type[joint] != mjJNT_SLIDE)
        throw InputError("joint '" + name +
                         "' has several axes and an actuator with armature: not supported");
      const double gear = m_->actuator_gear[6 * i];
      sum += m_->actuator_armature[i] * gear * gear;
    }
    return sum;
  }

  const mjModel* m_;
  std::vector<Frame> frames_;
  std::vector<Joint<double>> joints_;
  std::vector<std::string> names_;
};

}  // namespace

void install_mujoco_handlers() {
  mju_user_error = [](const char* message) { throw InputError("MuJoCo: " + one_line(message)); };
  mju_user_warning = [](const char*) {};
}

std::shared_ptr<const MujocoModel> MujocoModel::load(const std::string& path) {
  install_mujoco_handlers();
  if (!std::filesystem::is_regular_file(path)) throw InputError(path + ": no such file");
  char error[1024] = "";
  const SpecPtr spec(mj_parseXML(path.c_str(), nullptr, error, sizeof error), mj_deleteSpec);
  if (!spec) throw InputError(path + ": " + one_line(error));
  try {
    strip(spec.get());
    auto out = compile(spec.get(), path);
    out->lower();  // refuses here what it cannot hold
    return out;
  } catch (const InputError& e) {
    if (std::string(e.what()).starts_with(path)) throw;
    throw InputError(path + ": " + e.what());
  }
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
    const auto set_quat = [](double* to, const Quaternion& q) {
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

Model<double> MujocoModel::lower() const { return Lowering(get()).model(); }

}  // namespace kalmarm
