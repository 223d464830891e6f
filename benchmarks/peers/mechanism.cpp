#include "benchmarks/peers/mechanism.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Mechanism::Type type_of(Coordinate first) {
  switch (first) {
    case Coordinate::distance:
      return Mechanism::Type::slide;
    case Coordinate::quaternion:
      return Mechanism::Type::ball;
    case Coordinate::position:
      return Mechanism::Type::free;
    default:
      return Mechanism::Type::hinge;
  }
}

int dof_of(Mechanism::Type type) {
  return type == Mechanism::Type::free ? 6 : type == Mechanism::Type::ball ? 3 : 1;
}

}  // namespace

Mechanism make_mechanism(const Model<double>& model) {
  Mechanism out;
  out.nq = model.nq();
  out.nv = model.nv();
  out.model = &model;
  std::copy_n(model.gravity().data(), 3, out.gravity);
  std::vector<int> joint_of(model.nv(), -1);  // only the last DoF of a joint has its body
  for (int k = 0; k < model.nv();) {
    const Joint<double>& first = model.joint(k);
    Mechanism::Joint joint = {};
    joint.type = type_of(first.coordinate);
    joint.parent = first.parent < 0 ? -1 : joint_of[first.parent];
    joint.q = first.q_index;
    joint.v = k;
    joint.dof = dof_of(joint.type);
    joint.ref = first.ref;
    joint.armature = first.r;
    const int last = k + joint.dof - 1;
    bool whole = first.parent < 0 || joint.parent >= 0;
    for (int m = k; m <= last; ++m) {
      whole = whole && model.joint(m).r == first.r;
      if (m < last) whole = whole && model.joint(m).body.massless();
    }
    if (joint.type == Mechanism::Type::free) {
      const Joint<double>& turn = model.joint(k + 3);  // about the point that the slides have moved
      whole = whole && turn.coordinate == Coordinate::quaternion &&
              turn.q_index == first.q_index + 3 && turn.translation.isZero(0) &&
              model.E(k + 3).isIdentity(0);
    }
    if (!whole)
      throw InputError("joint '" + model.name(k) + "' is not one that other libraries know");
    Eigen::Map<RowMajor3>(joint.R) = model.E(k);
    std::copy_n(first.translation.data(), 3, joint.p);
    const RigidBody<double>& body = model.joint(last).body;
    joint.mass = body.mass;
    std::copy_n(body.com.data(), 3, joint.com);
    Eigen::Map<RowMajor3>(joint.inertia) = model.inertia(last).I_cm;
    joint_of[last] = static_cast<int>(out.joints.size());
    out.joints.push_back(joint);
    k += joint.dof;
  }
  return out;
}

Scene without_armature(const Scene& scene) {
  const Model<double>& model = scene.model;
  std::vector<Joint<double>> joints;
  for (int k = 0; k < model.nv(); ++k) {
    joints.push_back(model.joint(k));
    joints.back().r = 0;
  }
  Scene out = scene;
  out.model = Model<double>(std::move(joints), model.names(), model.nq(), model.gravity());
  return out;
}

}  // namespace kalmarm
