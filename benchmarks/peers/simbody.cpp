// Simbody, as Debian builds it. It has no armature. A ball's and a free joint's angular velocity
// and torque are in the axes of the joint's fixed side.
//
//   acceleration      State of q, u and mobility forces, realize(Acceleration), with uniform
//   gravity inverse_dynamics  State of q and u, realize(Dynamics),
//   calcResidualForceIgnoringConstraints inverse           State of q, realize(Position), calcMInv
//   mass              State of q, realize(Position), calcM
#include <Simbody.h>

#include <Eigen/Dense>
#include <algorithm>

#include "benchmarks/peers/peer.hpp"

namespace kalmarm {
namespace {

SimTK::Transform placement(const Mechanism::Joint& joint) {
  const double* R = joint.R;
  return {SimTK::Rotation(SimTK::Mat33(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8])),
          SimTK::Vec3(joint.p)};
}

SimTK::Body::Rigid body_of(const Mechanism::Joint& joint) {
  const double* I = joint.inertia;
  const SimTK::Vec3 com(joint.com);
  const SimTK::Inertia central(I[0], I[4], I[8], I[1], I[2], I[5]);
  return SimTK::Body::Rigid(
      SimTK::MassProperties(joint.mass, com, central.shiftFromMassCenter(com, joint.mass)));
}

class Simbody final : public Peer {
 public:
  explicit Simbody(const Mechanism& mechanism)
      : mechanism_(mechanism),
        matter_(system_),
        forces_(system_),
        gravity_(forces_, matter_, SimTK::Vec3(mechanism.gravity)),
        mobility_(forces_, matter_) {
    using namespace SimTK;
    std::vector<MobilizedBody> bodies;
    for (const Mechanism::Joint& joint : mechanism.joints) {
      MobilizedBody& parent =
          joint.parent < 0 ? static_cast<MobilizedBody&>(matter_.Ground()) : bodies[joint.parent];
      const Transform at = placement(joint);
      const Body::Rigid body = body_of(joint);
      switch (joint.type) {
        case Mechanism::Type::hinge:
          bodies.push_back(MobilizedBody::Pin(parent, at, body, Transform()));
          break;
        case Mechanism::Type::slide: {  // along x
          const Transform z_to_x(Rotation(Mat33(0, 1, 0, 0, 0, 1, 1, 0, 0)));
          bodies.push_back(MobilizedBody::Slider(parent, at * z_to_x, body, z_to_x));
          break;
        }
        case Mechanism::Type::ball:
          bodies.push_back(MobilizedBody::Ball(parent, at, body, Transform()));
          break;
        case Mechanism::Type::free:
          bodies.push_back(MobilizedBody::Free(parent, at, body, Transform()));
          break;
      }
    }
    state_ = system_.realizeTopology();
    system_.realizeModel(state_);
    for (const MobilizedBody& body : bodies) {
      first_q_.push_back(body.getFirstQIndex(state_));
      first_u_.push_back(body.getFirstUIndex(state_));
    }
  }

  std::string name() const override { return "Simbody"; }
  std::string version() const override {
    int major = 0, minor = 0, patch = 0;
    SimTK_version_simbody(&major, &minor, &patch);
    return "Simbody " + std::to_string(major) + "." + std::to_string(minor) + " (Debian's build)";
  }
  bool can(Task task) const override { return is_common(task); }
  bool has_armature() const override { return false; }

  void add_state(const double* q, const double* qd, const double* tau) override {
    const Eigen::MatrixXd Q = turn(q);
    const auto turned = [&](const double* x) {
      const Eigen::VectorXd y = Q * Eigen::Map<const Eigen::VectorXd>(x, mechanism_.nv);
      return SimTK::Vector(mechanism_.nv, y.data());
    };
    SimTK::Vector positions(mechanism_.nq);
    for (std::size_t i = 0; i < mechanism_.joints.size(); ++i) {
      const Mechanism::Joint& joint = mechanism_.joints[i];
      const bool is_free = joint.type == Mechanism::Type::free;
      const double* from = q + joint.q;
      double* to = &positions[first_q_[i]];
      if (is_free) std::copy_n(from, 3, to + 4);
      if (is_free || joint.type == Mechanism::Type::ball)
        std::copy_n(from + (is_free ? 3 : 0), 4, to);
      else
        *to = *from - joint.ref;
    }
    states_.push_back(
        {positions, turned(qd), turned(tau), {q, q + mechanism_.nq}, {qd, qd + mechanism_.nv}});
  }

  bool acceleration(int i) override {
    const Given& given = states_[i];
    state_.updQ() = given.q;
    state_.updU() = given.u;
    mobility_.setAllMobilityForces(state_, given.tau);
    system_.realize(state_, SimTK::Stage::Acceleration);
    return true;
  }
  bool inverse_dynamics(int i) override {
    const Given& given = states_[i];
    state_.updQ() = given.q;
    state_.updU() = given.u;
    system_.realize(state_, SimTK::Stage::Dynamics);
    matter_.calcResidualForceIgnoringConstraints(
        state_, SimTK::Vector(), system_.getRigidBodyForces(state_, SimTK::Stage::Dynamics),
        given.tau, torque_);
    return true;
  }
  bool inverse(int i) override {
    state_.updQ() = states_[i].q;
    system_.realize(state_, SimTK::Stage::Position);
    matter_.calcMInv(state_, matrix_);
    return true;
  }
  bool mass(int i) override {
    state_.updQ() = states_[i].q;
    system_.realize(state_, SimTK::Stage::Position);
    matter_.calcM(state_, matrix_);
    return true;
  }

  // With w the angular velocity in the fixed axes, w = R wB and w' = R wB', since wB x wB = 0.
  void get_acceleration(int i, double* a) const override {
    const SimTK::Vector& udot = state_.getUDot();
    const Eigen::Map<const Eigen::VectorXd> x(&udot[0], mechanism_.nv);
    Eigen::Map<Eigen::VectorXd>(a, mechanism_.nv) = turn(states_[i].given_q.data()).transpose() * x;
  }
  void get_torque(int i, double* tau) const override {
    const Eigen::Map<const Eigen::VectorXd> x(&torque_[0], mechanism_.nv);
    Eigen::Map<Eigen::VectorXd>(tau, mechanism_.nv) =
        turn(states_[i].given_q.data()).transpose() * x;
  }
  void get_matrix(int i, double* out) const override {
    const int nv = mechanism_.nv;
    Eigen::MatrixXd X(nv, nv);
    for (int row = 0; row < nv; ++row)
      for (int column = 0; column < nv; ++column) X(row, column) = matrix_(row, column);
    const Eigen::MatrixXd Q = turn(states_[i].given_q.data());
    Eigen::Map<Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(out, nv, nv) = Q.transpose() * X * Q;
  }

 private:
  struct Given {
    SimTK::Vector q, u, tau;
    std::vector<double> given_q, given_qd;
  };

  // u = Q qd, orthogonal.
  Eigen::MatrixXd turn(const double* q) const {
    Eigen::MatrixXd Q = Eigen::MatrixXd::Zero(mechanism_.nv, mechanism_.nv);
    for (std::size_t i = 0; i < mechanism_.joints.size(); ++i) {
      const Mechanism::Joint& joint = mechanism_.joints[i];
      const int u = first_u_[i];
      if (joint.dof == 1) {
        Q(u, joint.v) = 1;
        continue;
      }
      const bool is_free = joint.type == Mechanism::Type::free;
      const double* at = q + joint.q + (is_free ? 3 : 0);
      const Eigen::Quaterniond turned(at[0], at[1], at[2], at[3]);
      Q.block<3, 3>(u, joint.v + (is_free ? 3 : 0)) = turned.normalized().toRotationMatrix();
      if (is_free) Q.block<3, 3>(u + 3, joint.v).setIdentity();
    }
    return Q;
  }
  int states() const override { return static_cast<int>(states_.size()); }

  const Mechanism& mechanism_;
  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  SimTK::Force::UniformGravity gravity_;
  SimTK::Force::DiscreteForces mobility_;
  SimTK::State state_;
  std::vector<int> first_q_, first_u_;
  SimTK::Matrix matrix_;
  SimTK::Vector torque_;
  std::vector<Given> states_;
};

}  // namespace
}  // namespace kalmarm

void kalmarm_peers(const kalmarm::Mechanism& mechanism, kalmarm::Peers& peers) {
  peers.push_back(std::make_unique<kalmarm::Simbody>(mechanism));
}
