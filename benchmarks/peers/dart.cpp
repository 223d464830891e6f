// DART, as Debian builds it. It has no armature.
//
//   acceleration      setPositions, setVelocities, setForces, computeForwardDynamics
//   inverse_dynamics  setPositions, setVelocities, setAccelerations, computeInverseDynamics
//   inverse           setPositions, getInvMassMatrix (recursive)
//   mass              setPositions, getMassMatrix
// Its caches are filled again after every setPositions.
#include <algorithm>
#include <dart/config.hpp>
#include <dart/dynamics/BallJoint.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>

#include "benchmarks/peers/body_axes.hpp"

namespace kalmarm {
namespace {

using Row3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

dart::dynamics::SkeletonPtr make_skeleton(const Mechanism& mechanism) {
  using namespace dart::dynamics;
  const SkeletonPtr skeleton = Skeleton::create();
  skeleton->setGravity(Eigen::Vector3d(mechanism.gravity));
  std::vector<BodyNode*> bodies;
  for (const Mechanism::Joint& joint : mechanism.joints) {
    BodyNode* parent = joint.parent < 0 ? nullptr : bodies[joint.parent];
    const std::string name = std::to_string(bodies.size());
    Joint* made = nullptr;
    const auto add = [&](auto properties) {
      using Kind = typename decltype(properties)::type;
      auto [type, body] = skeleton->createJointAndBodyNodePair<Kind>(parent);
      body->setName("body" + name);
      type->setName("joint" + name);
      bodies.push_back(body);
      made = type;
      return type;
    };
    switch (joint.type) {
      case Mechanism::Type::hinge:
        add(std::type_identity<RevoluteJoint>())->setAxis(Eigen::Vector3d::UnitZ());
        break;
      case Mechanism::Type::slide:
        add(std::type_identity<PrismaticJoint>())->setAxis(Eigen::Vector3d::UnitZ());
        break;
      case Mechanism::Type::ball:
        add(std::type_identity<BallJoint>());
        break;
      case Mechanism::Type::free:
        add(std::type_identity<FreeJoint>());
        break;
    }
    Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
    at.linear() = Eigen::Map<const Row3>(joint.R);
    at.translation() = Eigen::Vector3d(joint.p);
    made->setTransformFromParentBodyNode(at);
    bodies.back()->setInertia(
        Inertia(joint.mass, Eigen::Vector3d(joint.com), Eigen::Map<const Row3>(joint.inertia)));
  }
  return skeleton;
}

// A free joint's angular part is first.
std::vector<int> order_of(const Mechanism& mechanism, const dart::dynamics::Skeleton& skeleton) {
  std::vector<int> out;
  for (std::size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Mechanism::Joint& joint = mechanism.joints[i];
    for (int k = 0; k < joint.dof; ++k)
      out.push_back(static_cast<int>(skeleton.getJoint(i)->getIndexInSkeleton(
          (k + joint.dof / 2 * (joint.dof == 6)) % joint.dof)));
  }
  return out;
}

class Dart final : public Peer {
 public:
  explicit Dart(const Mechanism& mechanism)
      : mechanism_(mechanism),
        skeleton_(make_skeleton(mechanism)),
        order_(order_of(mechanism, *skeleton_)),
        axes_(mechanism, order_) {}

  std::string name() const override { return "DART"; }
  std::string version() const override { return "DART " DART_VERSION " (Debian's build)"; }
  bool can(Task task) const override { return is_common(task); }
  bool has_armature() const override { return false; }

  void add_state(const double* q, const double* qd, const double* tau) override {
    using namespace dart::dynamics;
    Vector positions(mechanism_.nv);
    for (const Mechanism::Joint& joint : mechanism_.joints) {
      const auto put = [&](const auto& values) {
        for (int k = 0; k < joint.dof; ++k)
          positions[order_[joint.v + (joint.dof == 6 ? (k + 3) % 6 : k)]] = values[k];
      };
      if (joint.type == Mechanism::Type::ball) {
        put(BallJoint::convertToPositions(quaternion_at(q + joint.q).toRotationMatrix()));
      } else if (joint.type == Mechanism::Type::free) {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.linear() = quaternion_at(q + joint.q + 3).toRotationMatrix();
        pose.translation() = Eigen::Vector3d(q + joint.q);
        put(FreeJoint::convertToPositions(pose));
      } else {
        put(Eigen::Matrix<double, 1, 1>(q[joint.q] - joint.ref));
      }
    }
    states_.push_back({positions,
                       axes_.to_library(q, qd),
                       axes_.to_library(q, tau),
                       axes_.acceleration_to_library(q, qd, tau),
                       {q, q + mechanism_.nq},
                       {qd, qd + mechanism_.nv}});
  }

  bool acceleration(int i) override {
    const State& state = states_[i];
    skeleton_->setPositions(state.q);
    skeleton_->setVelocities(state.qd);
    skeleton_->setForces(state.tau);
    skeleton_->computeForwardDynamics();
    return true;
  }
  bool inverse_dynamics(int i) override {
    const State& state = states_[i];
    skeleton_->setPositions(state.q);
    skeleton_->setVelocities(state.qd);
    skeleton_->setAccelerations(state.qdd);
    skeleton_->computeInverseDynamics();
    return true;
  }
  bool inverse(int i) override {
    skeleton_->setPositions(states_[i].q);
    matrix_ = &skeleton_->getInvMassMatrix();
    return true;
  }
  bool mass(int i) override {
    skeleton_->setPositions(states_[i].q);
    matrix_ = &skeleton_->getMassMatrix();
    return true;
  }

  void get_acceleration(int i, double* a) const override {
    const State& state = states_[i];
    axes_.acceleration(state.given_q.data(), state.given_qd.data(), skeleton_->getAccelerations(),
                       a);
  }
  void get_torque(int i, double* tau) const override {
    axes_.torque(states_[i].given_q.data(), skeleton_->getForces(), tau);
  }
  void get_matrix(int i, double* out) const override {
    axes_.matrix(states_[i].given_q.data(), *matrix_, out);
  }

 private:
  struct State {
    Vector q, qd, tau, qdd;
    std::vector<double> given_q, given_qd;
  };

  int states() const override { return static_cast<int>(states_.size()); }

  const Mechanism& mechanism_;
  dart::dynamics::SkeletonPtr skeleton_;
  std::vector<int> order_;
  BodyAxes axes_;
  const Matrix* matrix_ = nullptr;
  std::vector<State> states_;
};

}  // namespace
}  // namespace kalmarm

void kalmarm_peers(const kalmarm::Mechanism& mechanism, kalmarm::Peers& peers) {
  peers.push_back(std::make_unique<kalmarm::Dart>(mechanism));
}
