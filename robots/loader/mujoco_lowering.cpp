// lowered: from a compiled model to one-DoF joints.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/spatial/principal_axes.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_model.hpp"
#include "robots/loader/mujoco_shim.hpp"

namespace kalmarm {
namespace {

using Quaternion = Eigen::Quaternion<double>;
using Vec3 = Vector3<double>;
using Frame = LinkFrame;

// A turn that takes e_z to `axis`; exact for the coordinate axes. To an axis that points down by way
// of the opposite one: a turn by nearly half a circle would lose half the digits.
Quaternion turn_z_to(const Vec3& axis) {
  const Quaternion to_x(0.5, 0.5, 0.5, 0.5), to_y(0.5, -0.5, -0.5, -0.5), flip(0, 1, 0, 0);
  if (axis == Vec3(0, 0, 1)) return Quaternion::Identity();
  if (axis == Vec3(1, 0, 0)) return to_x;
  if (axis == Vec3(0, 1, 0)) return to_y;
  if (axis == Vec3(0, 0, -1)) return flip;
  if (axis == Vec3(-1, 0, 0)) return to_x * flip;
  if (axis == Vec3(0, -1, 0)) return to_y * flip;
  if (axis.z() < 0) return flip * turn_z_to({axis.x(), -axis.y(), -axis.z()});
  return Quaternion::FromTwoVectors(Vec3::UnitZ(), axis);
}

Vec3 vec3(const mjtNum* x) { return {x[0], x[1], x[2]}; }
Quaternion quat(const mjtNum* x) { return {x[0], x[1], x[2], x[3]}; }

class Lowering {
 public:
  // `weights`: with the weights alone that the file compensates, as points.
  explicit Lowering(const mjModel* m, bool weights = false)
      : m_(m), weights_(weights), frames_(m->nbody) {
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
      const double length = joint.rotation.norm();
      if (!(std::abs(length - 1) < 1e-6))
        throw InputError("joint '" + names_[k] + "' or its body: a quaternion is out of range");
      if (joint.r < 0)
        throw InputError("joint '" + names_[k] + "' has armature " + std::to_string(joint.r) +
                         ": must not be negative");
    }
    const bool falls = (m_->opt.disableflags & mjDSBL_GRAVITY) == 0;
    const Vec3 gravity = falls ? vec3(m_->opt.gravity) : Vec3::Zero().eval();
    if (!gravity.allFinite()) throw InputError("gravity: a number is not finite");
    return {std::move(joints_), std::move(names_), static_cast<int>(m_->nq), gravity};
  }

  std::vector<LinkFrame> frames() && { return std::move(frames_); }

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
    if (weights_) {
      inertia.mass *= std::max(m_->body_gravcomp[body], 0.0);
      inertia.moments.setZero();
    }
    RigidBody<double>& link = joints_[frame.link].body;
    link = welded(link, inertia);
  }

  // Adds joint j to a body that stands at `frame` when the joint is at its reference; returns where
  // the body stands in the joint's last link.
  Frame add_joint(int j, const Frame& frame) {
    const Vec3 anchor = vec3(m_->jnt_pos + 3 * j);
    const int q = m_->jnt_qposadr[j];
    const std::string name = name_of_joint(j);
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

  // One that has none is its body's, with its number there where that has several joints.
  std::string name_of_joint(int j) const {
    if (const char* given = mj_id2name(m_, mjOBJ_JOINT, j)) return given;
    const int body = m_->jnt_bodyid[j];
    std::string name = "body" + std::to_string(body);
    const auto taken_by = [&](mjtObj kind) { return mj_name2id(m_, kind, name.c_str()) >= 0; };
    while (taken_by(mjOBJ_BODY)) name += "_";
    if (const char* of_body = mj_id2name(m_, mjOBJ_BODY, body)) name = of_body;
    name += "_joint";
    if (m_->body_jntnum[body] > 1) name += std::to_string(j - m_->body_jntadr[body] + 1);
    while (taken_by(mjOBJ_JOINT)) name += "_";
    return name;
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
    if (!weights_) joint.r = m_->dof_armature[k] + reflected_armature(m_->dof_jntid[k], name);
    joints_.push_back(joint);
    names_.push_back(name);
    return k;
  }

  // Armature of the actuators that drive a joint, as its own inertia feels it.
  double reflected_armature(int joint, const std::string& name) const {
    double sum = 0;
    for (int i = 0; i < actuator_count(m_); ++i) {
      if (m_->actuator_trntype[i] == mjTRN_TENDON || m_->actuator_trnid[2 * i] != joint ||
          m_->actuator_armature[i] == 0)
        continue;
      if (m_->jnt_type[joint] != mjJNT_HINGE && m_->jnt_type[joint] != mjJNT_SLIDE)
        throw InputError("joint '" + name +
                         "' has several axes and an actuator with armature: not supported");
      const double gear = m_->actuator_gear[6 * i];
      sum += m_->actuator_armature[i] * gear * gear;
    }
    return sum;
  }

  const mjModel* m_;
  bool weights_;
  std::vector<Frame> frames_;
  std::vector<Joint<double>> joints_;
  std::vector<std::string> names_;
};

}  // namespace

Model<double> lowered(const mjModel* m) { return Lowering(m).model(); }

VectorX<double> diagonal_at_start(const mjModel* m) {
  const Model<double> model = lowered(m);
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(model.nv(), model.nv());
  set_position(model, Eigen::Map<const VectorX<double>>(m->qpos0, m->nq), kin);
  mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
  return M.diagonal();
}

std::optional<Model<double>> MujocoModel::compensated() const {
  const mjModel* m = get();
  constexpr int passive = mjDSBL_SPRING | mjDSBL_DAMPER;  // both off: no passive force at all
  const bool any = std::any_of(m->body_gravcomp, m->body_gravcomp + m->nbody,
                               [](double share) { return share > 0; });
  if (!any || (m->opt.disableflags & passive) == passive) return std::nullopt;
  return Lowering(m, true).model();
}

std::vector<LinkFrame> MujocoModel::body_frames() const { return Lowering(get()).frames(); }

std::vector<NamedLinkFrame> MujocoModel::frames() const {
  const mjModel* m = get();
  const std::vector<LinkFrame> bodies = body_frames();
  std::vector<NamedLinkFrame> out;
  const auto add = [&](mjtObj kind, int i, const LinkFrame& at) {
    if (const char* name = mj_id2name(m, kind, i); name && *name) out.push_back({name, at});
  };
  for (int i = 0; i < m->nsite; ++i)
    add(mjOBJ_SITE, i,
        bodies[m->site_bodyid[i]].then(vec3(m->site_pos + 3 * i), quat(m->site_quat + 4 * i)));
  for (int i = 0; i < m->nbody; ++i) add(mjOBJ_BODY, i, bodies[i]);
  return out;
}

}  // namespace kalmarm
