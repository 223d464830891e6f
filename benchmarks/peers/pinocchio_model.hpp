// What the modules that use Pinocchio share: its model of a mechanism, and the states in its
// conventions. It takes a free joint's linear velocity in the body's axes (body_axes.hpp), and
// orders a quaternion x, y, z, w.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <pinocchio/multibody.hpp>
#include <string>
#include <vector>

#include "benchmarks/peers/body_axes.hpp"

namespace kalmarm {

// Joints: a collection with RZ, PZ, Spherical and FreeFlyer.
template <template <class, int> class Joints>
pinocchio::ModelTpl<double, 0, Joints> make_model(const Mechanism& mechanism) {
  namespace pin = pinocchio;
  using Type = Mechanism::Type;
  pin::ModelTpl<double, 0, Joints> model;
  model.gravity.linear() = Eigen::Map<const Eigen::Vector3d>(mechanism.gravity);
  std::vector<pin::JointIndex> ids;
  Vector armature(mechanism.nv);
  for (const Mechanism::Joint& joint : mechanism.joints) {
    using Row3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Matrix3d R = Eigen::Map<const Row3>(joint.R);
    const Eigen::Matrix3d I = Eigen::Map<const Row3>(joint.inertia);
    const Eigen::Vector3d p(joint.p), com(joint.com);
    const pin::JointIndex parent = joint.parent < 0 ? 0 : ids[joint.parent];
    const std::string name = "joint" + std::to_string(ids.size());
    const auto add = [&](const auto& type) {
      ids.push_back(model.addJoint(parent, type, pin::SE3(R, p), name));
    };
    switch (joint.type) {
      case Type::hinge:
        add(pin::JointModelRZ());
        break;
      case Type::slide:
        add(pin::JointModelPZ());
        break;
      case Type::ball:
        add(pin::JointModelSpherical());
        break;
      case Type::free:
        add(pin::JointModelFreeFlyer());
        break;
    }
    model.appendBodyToJoint(ids.back(), pin::Inertia(joint.mass, com, I), pin::SE3::Identity());
    armature.segment(joint.v, joint.dof).setConstant(joint.armature);
  }
  model.armature = armature;
  return model;
}

struct PinocchioState {
  Vector q, qd, tau, qdd;               // in Pinocchio's conventions; qdd: the numbers of tau
  Vector given_q, given_qd, given_tau;  // in Kalmarm's
};

inline PinocchioState make_state(const Mechanism& mechanism, const BodyAxes& axes, const double* q,
                                 const double* qd, const double* tau) {
  PinocchioState state = {Vector(mechanism.nq),    axes.to_library(q, qd),
                          axes.to_library(q, tau), axes.acceleration_to_library(q, qd, tau),
                          Vector(mechanism.nq),    Vector(mechanism.nv),
                          Vector(mechanism.nv)};
  std::copy_n(q, mechanism.nq, state.given_q.data());
  std::copy_n(qd, mechanism.nv, state.given_qd.data());
  std::copy_n(tau, mechanism.nv, state.given_tau.data());
  state.q = state.given_q;
  for (const Mechanism::Joint& joint : mechanism.joints) {
    const bool is_free = joint.type == Mechanism::Type::free;
    if (!is_free && joint.type != Mechanism::Type::ball) {
      state.q[joint.q] -= joint.ref;
      continue;
    }
    const int at = joint.q + (is_free ? 3 : 0);
    state.q.segment<4>(at) = quaternion_at(q + at).coeffs();  // x, y, z, w
  }
  return state;
}

}  // namespace kalmarm
