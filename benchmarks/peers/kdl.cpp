// Orocos KDL, as Debian builds it: serial chains of hinges and slides.
//
//   acceleration      ChainFdSolver_RNE: M, bias, and a dense L D L'
//   inverse_dynamics  ChainIdSolver_RNE
//   mass              ChainDynParam::JntToMass
#include <kdl/config.h>

#include <algorithm>
#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainfdsolver_recursive_newton_euler.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

#include "benchmarks/peers/peer.hpp"

namespace kalmarm {
namespace {

KDL::Frame frame_of(const Mechanism::Joint& joint) {
  const double* R = joint.R;
  return {KDL::Rotation(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]),
          KDL::Vector(joint.p[0], joint.p[1], joint.p[2])};
}

// A segment turns first and then goes to its tip, where the next joint is: so the first, fixed one
// goes to joint 0. Its inertia is given at the tip.
KDL::Chain make_chain(const Mechanism& mechanism) {
  KDL::Chain chain;
  const auto& joints = mechanism.joints;
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame_of(joints.front())));
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const Mechanism::Joint& joint = joints[i];
    const KDL::Frame tip = i + 1 < joints.size() ? frame_of(joints[i + 1]) : KDL::Frame();
    const double* I = joint.inertia;
    const KDL::RigidBodyInertia body(joint.mass,
                                     KDL::Vector(joint.com[0], joint.com[1], joint.com[2]),
                                     KDL::RotationalInertia(I[0], I[4], I[8], I[1], I[2], I[5]));
    const auto type = joint.type == Mechanism::Type::slide ? KDL::Joint::TransZ : KDL::Joint::RotZ;
    chain.addSegment(
        KDL::Segment(KDL::Joint(type, 1, -joint.ref, joint.armature), tip, tip.Inverse() * body));
  }
  return chain;
}

class Kdl final : public Peer {
 public:
  explicit Kdl(const Mechanism& mechanism)
      : nv_(mechanism.nv),
        chain_(make_chain(mechanism)),
        gravity_(mechanism.gravity[0], mechanism.gravity[1], mechanism.gravity[2]),
        dynamics_(chain_, gravity_),
        inverse_dynamics_(chain_, gravity_),
        parameters_(chain_, gravity_),
        no_forces_(chain_.getNrOfSegments(), KDL::Wrench::Zero()),
        a_(nv_),
        torque_(nv_),
        M_(nv_) {}

  std::string name() const override { return "KDL"; }
  std::string version() const override { return "KDL " KDL_VERSION_STRING " (Debian's build)"; }
  bool can(Task task) const override { return is_common(task) && task != Task::inverse; }

  void add_state(const double* q, const double* qd, const double* tau) override {
    const auto array = [this](const double* x) {
      KDL::JntArray out(nv_);
      std::copy_n(x, nv_, out.data.data());
      return out;
    };
    states_.push_back({array(q), array(qd), array(tau)});
  }

  bool acceleration(int i) override {
    const State& state = states_[i];
    return dynamics_.CartToJnt(state.q, state.qd, state.tau, no_forces_, a_) >= 0;
  }
  bool inverse_dynamics(int i) override {
    const State& state = states_[i];
    return inverse_dynamics_.CartToJnt(state.q, state.qd, state.tau, no_forces_, torque_) >= 0;
  }
  bool mass(int i) override { return parameters_.JntToMass(states_[i].q, M_) >= 0; }

  void get_acceleration(int, double* a) const override { std::copy_n(a_.data.data(), nv_, a); }
  void get_torque(int, double* tau) const override { std::copy_n(torque_.data.data(), nv_, tau); }
  void get_matrix(int, double* out) const override {
    std::copy_n(M_.data.data(), nv_ * nv_, out);  // symmetric
  }

 private:
  struct State {
    KDL::JntArray q, qd, tau;
  };

  int states() const override { return static_cast<int>(states_.size()); }

  int nv_;
  KDL::Chain chain_;
  KDL::Vector gravity_;
  KDL::ChainFdSolver_RNE dynamics_;
  KDL::ChainIdSolver_RNE inverse_dynamics_;
  KDL::ChainDynParam parameters_;
  KDL::Wrenches no_forces_;
  KDL::JntArray a_, torque_;
  KDL::JntSpaceInertiaMatrix M_;
  std::vector<State> states_;
};

}  // namespace
}  // namespace kalmarm

void kalmarm_peers(const kalmarm::Mechanism& mechanism, kalmarm::Peers& peers) {
  if (mechanism.is_chain() && mechanism.has_only_hinges_and_slides())
    peers.push_back(std::make_unique<kalmarm::Kdl>(mechanism));
}
