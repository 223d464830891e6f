// Every body's joint is lowered to DoF whose axis is z (kalmarm/robot_model.hpp). With A the turn of
// e_z to the axis of a hinge or slide, 1 for other joints, and Y that of the parent's, the link's
// frame is the body's turned by A:
//   E = Y^-1 R A,  d = Y^-1 p          placement of the joint, R and p those of the body
//   c <- A^-1 c,   axes <- A^-1 axes   its inertia
// A body that is fixed stands at (Y^-1 R, Y^-1 p) on its parent's link and is welded to it.
#include "kalmarm/model_builder.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"
#include "algorithms/spatial/principal_axes.hpp"

namespace kalmarm {
namespace {

using Quaternion = Eigen::Quaternion<double>;
using Translation = Vector3<double>;

// Takes e_z to the axis a, exactly where that is one of the coordinate axes: about e_z x a by the
// half angle; of axes that point down, after half a turn about e_x.
Quaternion turn_to(const Translation& a) {
  if (a[2] < -0.5) return Quaternion(0, 1, 0, 0) * turn_to({a[0], -a[1], -a[2]});
  return {1 + a[2], -a[1], a[0], 0};
}

// Where a body's frame stands on a link; -1: the fixed base.
struct Standing {
  int link = -1;
  Quaternion rotation = Quaternion::Identity();
  Translation translation = Translation::Zero();
};

}  // namespace

struct ModelBuilder::State {
  std::vector<Joint<double>> joints;
  std::vector<std::string> names;
  std::vector<Standing> bodies;
  std::vector<int> first_dof, first_q;
  int nq = 0;
  Translation gravity = {0, 0, -9.81};

  int add(Joint<double> joint, const std::string& name) {
    joints.push_back(std::move(joint));
    names.push_back(name);
    return static_cast<int>(joints.size()) - 1;
  }

  // Three DoF about, or along, the axes of one joint; the last link is returned.
  int add_three(Joint<double> first, const std::string& name) {
    const RigidBody<double> body = std::exchange(first.body, {});
    Joint<double> follower;
    follower.slides = first.slides;
    follower.coordinate = Coordinate::follower;
    follower.r = first.r;
    nq += q_entries(first.coordinate);
    follower.parent = add(first, name + (first.slides ? "_x" : "_rx"));
    follower.parent = add(follower, name + (first.slides ? "_y" : "_ry"));
    follower.body = body;
    return add(follower, name + (first.slides ? "_z" : "_rz"));
  }
};

ModelBuilder::ModelBuilder() : state_(std::make_unique<State>()) {}
ModelBuilder::~ModelBuilder() = default;
ModelBuilder::ModelBuilder(ModelBuilder&&) noexcept = default;
ModelBuilder& ModelBuilder::operator=(ModelBuilder&&) noexcept = default;

ModelBuilder::State& ModelBuilder::state() const {
  if (!state_) throw std::logic_error("ModelBuilder: was moved from, and holds no robot");
  return *state_;
}

int ModelBuilder::add_body(const BodyParameters& given) {
  State& s = state();
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("body '" + given.name + "': " + why);
  };
  const auto finite = [&](const char* what, const auto& numbers) {
    for (const double x : numbers)
      if (!std::isfinite(x)) refuse(std::string(what) + " holds " + short_text("%g", x));
  };
  finite("axis", given.axis);
  finite("position", given.position);
  finite("rotation", given.rotation);
  finite("centre of mass", given.center_of_mass);
  finite("inertia", given.inertia);
  finite("reference, armature and mass",
         std::array<double, 3>{given.reference, given.armature, given.mass});
  const int joint_type = static_cast<int>(given.joint);
  if (joint_type < 0 || joint_type > static_cast<int>(JointType::free))
    refuse("joint type " + std::to_string(joint_type) + " is none");
  if (given.parent < -1 || given.parent >= static_cast<int>(s.bodies.size()))
    refuse("parent " + std::to_string(given.parent) + " is not there");
  if (given.mass < 0) refuse("mass is " + short_text("%g", given.mass));
  if (given.armature < 0) refuse("armature is " + short_text("%g", given.armature));
  const Translation axis(given.axis.data());
  if (!std::isnormal(axis.squaredNorm()))
    refuse("the axis has length " + short_text("%g", axis.stableNorm()));
  const Quaternion R = quaternion_of(given.rotation);
  if (!is_turn(R)) refuse("the quaternion has length " + short_text("%g", R.coeffs().stableNorm()));

  const auto& [xx, yy, zz, xy, xz, yz] = given.inertia;
  Matrix3<double> I;
  I << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  RigidBody<double> body =
      with_principal_axes<double>(given.mass, Translation(given.center_of_mass.data()), I);
  // Of moments in rising order the largest is at most the sum of the others; rounding is forgiven.
  Translation& J = body.moments;
  const double rounding = 1e-9 * std::abs(J[2]);
  if (J[0] < -rounding) refuse("a principal moment of inertia is " + short_text("%g", J[0]));
  if (given.solid && J[2] > J[0] + J[1] + rounding)
    refuse("no body has the principal moments of inertia " + short_text("%g", J[0]) + ", " +
           short_text("%g", J[1]) + ", " + short_text("%g", J[2]) +
           ": the largest is more than the sum of the others");
  J = J.cwiseMax(0.0);

  const Standing parent = given.parent < 0 ? Standing() : s.bodies[given.parent];
  const Matrix3<double> Y = rotation(parent.rotation);
  const Standing at{parent.link, parent.rotation * R,
                    parent.translation + Y * Translation(given.position.data())};
  const bool has_axis = given.joint == JointType::hinge || given.joint == JointType::slide;

  Standing standing = at;
  int first_dof = -1, first_q = -1;
  if (given.joint == JointType::fixed) {
    body.com = at.translation + rotation(at.rotation) * body.com;
    body.axes = at.rotation * body.axes;
    if (at.link >= 0) {
      RigidBody<double>& link = s.joints[at.link].body;
      link = welded(link, body);
    }
  } else {
    const Quaternion A = has_axis ? turn_to(axis / axis.norm()) : Quaternion::Identity();
    Joint<double> joint;
    joint.parent = at.link;
    joint.rotation = at.rotation * A;
    joint.translation = at.translation;
    joint.r = given.armature;
    joint.q_index = s.nq;
    body.com = rotation(A).transpose() * body.com;
    body.axes = A.conjugate() * body.axes;
    joint.body = body;
    first_dof = static_cast<int>(s.joints.size());
    first_q = s.nq;
    standing = {-1, A.conjugate(), Translation::Zero()};
    switch (given.joint) {
      case JointType::slide:
        joint.slides = true;
        joint.coordinate = Coordinate::distance;
        [[fallthrough]];
      case JointType::hinge:
        joint.ref = given.reference;
        ++s.nq;
        standing.link = s.add(joint, given.name);
        break;
      case JointType::ball:
        joint.coordinate = Coordinate::quaternion;
        standing.link = s.add_three(joint, given.name);
        break;
      case JointType::free: {
        joint.slides = true;
        joint.coordinate = Coordinate::position;
        joint.body = {};
        Joint<double> ball;
        ball.parent = s.add_three(joint, given.name);
        ball.coordinate = Coordinate::quaternion;
        ball.q_index = s.nq;
        ball.r = given.armature;
        ball.body = body;
        standing.link = s.add_three(ball, given.name);
        break;
      }
      case JointType::fixed:
        break;
    }
  }
  s.bodies.push_back(standing);
  s.first_dof.push_back(first_dof);
  s.first_q.push_back(first_q);
  return static_cast<int>(s.bodies.size()) - 1;
}

void ModelBuilder::set_gravity(const std::array<double, 3>& gravity) {
  for (const double x : gravity)
    if (!std::isfinite(x)) throw std::invalid_argument("gravity holds " + short_text("%g", x));
  state().gravity = Translation(gravity.data());
}

int ModelBuilder::nq() const { return state().nq; }
int ModelBuilder::nv() const { return static_cast<int>(state().joints.size()); }
int ModelBuilder::first_dof(int body) const { return state().first_dof.at(body); }
int ModelBuilder::first_q(int body) const { return state().first_q.at(body); }

Frame ModelBuilder::frame(int body) const {
  const Standing& at = state().bodies.at(body);
  return {at.link, plain(at.rotation.normalized()), plain(at.translation)};
}

RobotModel ModelBuilder::build() const {
  const State& s = state();
  return plain(Model<double>(s.joints, s.names, s.nq, s.gravity));
}

}  // namespace kalmarm
