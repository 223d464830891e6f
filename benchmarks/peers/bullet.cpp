// Bullet's btMultiBody in double precision, as Debian builds it: trees of hinges and slides on a
// fixed base, or with a free joint at the root. It has no armature.
//
//   acceleration  positions, velocities, forces with gravity at every body, and
//                 computeAccelerationsArticulatedBodyAlgorithmMultiDof with a step of zero
// A link's frame stands at its com, along its principal axes. A free base moves in world axes.
#include <BulletDynamics/Featherstone/btMultiBody.h>

#include <Eigen/Dense>
#include <algorithm>
#include <memory>

#include "benchmarks/peers/peer.hpp"

namespace kalmarm {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Row3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

btVector3 vector(const Vector3d& x) { return {x[0], x[1], x[2]}; }
btQuaternion quaternion(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return {q.x(), q.y(), q.z(), q.w()};
}
Vector3d eigen(const btScalar* x) { return Vector3d(x[0], x[1], x[2]); }

// Com, principal axes and moments in the joint's frame.
struct Principal {
  Vector3d com = Vector3d::Zero(), moments = Vector3d::Zero();
  Matrix3d axes = Matrix3d::Identity();

  Principal() = default;
  explicit Principal(const Mechanism::Joint& joint) : com(joint.com) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(Eigen::Map<const Row3>(joint.inertia));
    moments = eigen.eigenvalues();
    axes = eigen.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  }
};

class Bullet final : public Peer {
 public:
  explicit Bullet(const Mechanism& mechanism)
      : mechanism_(mechanism),
        is_free_(mechanism.joints[0].type == Mechanism::Type::free),
        gravity_(mechanism.gravity[0], mechanism.gravity[1], mechanism.gravity[2]) {
    const auto& joints = mechanism.joints;
    std::vector<Principal> bodies(joints.begin(), joints.end());
    if (is_free_) base_ = bodies[0];
    const int links = static_cast<int>(joints.size()) - is_free_;
    body_ = std::make_unique<btMultiBody>(links, is_free_ ? joints[0].mass : 0,
                                          vector(base_.moments), !is_free_, false);
    for (int link = 0; link < links; ++link) {
      const Mechanism::Joint& joint = joints[link + is_free_];
      const Principal& own = bodies[link + is_free_];
      const Principal& parent = joint.parent < 0 ? base_ : bodies[joint.parent];
      const Matrix3d R = Eigen::Map<const Row3>(joint.R);
      const btQuaternion turn = quaternion((own.axes.transpose() * R.transpose() * parent.axes));
      const btVector3 axis = vector(own.axes.transpose() * Vector3d::UnitZ());
      const btVector3 pivot = vector(parent.axes.transpose() * (Vector3d(joint.p) - parent.com));
      const btVector3 com = vector(own.axes.transpose() * own.com);
      const int to = joint.parent - is_free_;
      if (joint.type == Mechanism::Type::slide)
        body_->setupPrismatic(link, joint.mass, vector(own.moments), std::max(to, -1), turn, axis,
                              pivot, com, false);
      else
        body_->setupRevolute(link, joint.mass, vector(own.moments), std::max(to, -1), turn, axis,
                             pivot, com, false);
    }
    body_->finalizeMultiDof();
    body_->setLinearDamping(0);
    body_->setAngularDamping(0);
  }

  std::string name() const override { return "Bullet"; }
  std::string version() const override {
    return "Bullet " + std::to_string(BT_BULLET_VERSION / 100) + "." +
           std::to_string(BT_BULLET_VERSION % 100) + " (Debian's build, float64)";
  }
  bool can(Task task) const override { return task == Task::acceleration; }
  bool has_armature() const override { return false; }

  void add_state(const double* q, const double* qd, const double* tau) override {
    State state = {};
    for (std::size_t i = is_free_; i < mechanism_.joints.size(); ++i) {
      const Mechanism::Joint& joint = mechanism_.joints[i];
      state.q.push_back(q[joint.q] - joint.ref);
      state.qd.push_back(qd[joint.v]);
      state.tau.push_back(tau[joint.v]);
    }
    if (is_free_) {
      const Mechanism::Joint& root = mechanism_.joints[0];
      state.E = Eigen::Map<const Row3>(root.R);
      const double* turn = q + root.q + 3;
      state.R =
          state.E *
          Eigen::Quaterniond(turn[0], turn[1], turn[2], turn[3]).normalized().toRotationMatrix();
      state.r = state.R * base_.com;
      state.w = state.R * eigen(qd + 3);
      const Vector3d force = state.E * eigen(tau);
      state.position = vector(Vector3d(root.p) + state.E * eigen(q + root.q) + state.r);
      state.world_to_base = quaternion((state.R * base_.axes).transpose());
      state.omega = vector(state.w);
      state.velocity = vector(state.E * eigen(qd) + state.w.cross(state.r));
      state.force = vector(force);
      state.torque = vector(state.R * eigen(tau + 3) - state.r.cross(force));
    }
    states_.push_back(state);
  }

  bool acceleration(int i) override {
    const State& state = states_[i];
    body_->clearForcesAndTorques();
    if (is_free_) {
      body_->setBasePos(state.position);
      body_->setWorldToBaseRot(state.world_to_base);
      body_->setBaseOmega(state.omega);
      body_->setBaseVel(state.velocity);
      body_->addBaseForce(state.force + gravity_ * body_->getBaseMass());
      body_->addBaseTorque(state.torque);
    }
    for (int link = 0; link < body_->getNumLinks(); ++link) {
      body_->setJointPos(link, state.q[link]);
      body_->setJointVel(link, state.qd[link]);
      body_->addJointTorque(link, state.tau[link]);
      body_->addLinkForce(link, gravity_ * body_->getLinkMass(link));
    }
    body_->computeAccelerationsArticulatedBodyAlgorithmMultiDof(0, numbers_, vectors_, matrices_,
                                                                false, false, false);
    return true;
  }

  // The scratch numbers begin with nv for the sweep; behind them is the result, the base first.
  void get_acceleration(int i, double* a) const override {
    const State& state = states_[i];
    const btScalar* out = &numbers_[body_->getNumDofs()];
    if (is_free_) {
      const Vector3d alpha = eigen(out);
      const Vector3d origin =
          eigen(out + 3) - alpha.cross(state.r) - state.w.cross(state.w.cross(state.r));
      Eigen::Map<Vector3d>(a, 3) = state.E.transpose() * origin;
      Eigen::Map<Vector3d>(a + 3, 3) = state.R.transpose() * alpha;
    }
    std::copy_n(out + 6, body_->getNumDofs(), a + (is_free_ ? 6 : 0));
  }

 private:
  struct State {
    std::vector<double> q, qd, tau;
    Matrix3d E, R;  // of the free joint and of its body, to the world
    Vector3d r, w;  // from the body's origin to its com, and its angular velocity; world axes
    btVector3 position, omega, velocity, force, torque;
    btQuaternion world_to_base;
  };

  int states() const override { return static_cast<int>(states_.size()); }

  const Mechanism& mechanism_;
  bool is_free_;
  btVector3 gravity_;
  Principal base_;
  std::unique_ptr<btMultiBody> body_;
  btAlignedObjectArray<btScalar> numbers_;
  btAlignedObjectArray<btVector3> vectors_;
  btAlignedObjectArray<btMatrix3x3> matrices_;
  std::vector<State> states_;
};

// What btMultiBody can hold.
bool fits(const Mechanism& mechanism) {
  for (std::size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Mechanism::Joint& joint = mechanism.joints[i];
    const bool is_simple =
        joint.type == Mechanism::Type::hinge || joint.type == Mechanism::Type::slide;
    const bool is_base = joint.type == Mechanism::Type::free && i == 0;
    const bool beside_base =
        i > 0 && joint.parent < 0 && mechanism.joints[0].type == Mechanism::Type::free;
    if (!(is_simple || is_base) || beside_base) return false;
  }
  return true;
}

}  // namespace
}  // namespace kalmarm

void kalmarm_peers(const kalmarm::Mechanism& mechanism, kalmarm::Peers& peers) {
  if (kalmarm::fits(mechanism)) peers.push_back(std::make_unique<kalmarm::Bullet>(mechanism));
}
