// Pinocchio from its headers, with the compiler and the flags that Kalmarm's own code has; its
// library is not linked. A variant for each convention of aba and crba.
//
//   acceleration      aba
//   inverse_dynamics  rnea
//   inverse           computeMinverse, which fills the upper triangle, and its mirror image
//   mass              crba, the same
//   TASK_triangle     without the mirror image
//   derivatives       computeABADerivatives
// Results stay in pinocchio::Data.
#include <algorithm>
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include "benchmarks/peers/body_axes.hpp"

namespace kalmarm {
namespace {

namespace pin = pinocchio;

// Data allocates four tensors of nv^3 numbers: 4 GB at 500, for a moment.
constexpr int largest_nv = 512;

pin::Model make_model(const Mechanism& mechanism) {
  using Type = Mechanism::Type;
  pin::Model model;
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

// The lower triangle from the upper one, in blocks that stay in the cache.
template <class Stored>
void mirror(Stored& X) {
  constexpr int block = 16;
  const int n = static_cast<int>(X.rows());
  double* x = X.data();
  for (int i0 = 0; i0 < n; i0 += block)
    for (int j0 = 0; j0 <= i0; j0 += block)
      for (int i = i0; i < std::min(i0 + block, n); ++i)
        for (int j = j0; j < std::min(j0 + block, i); ++j)
          if constexpr (Stored::IsRowMajor)
            x[i * n + j] = x[j * n + i];
          else
            x[j * n + i] = x[i * n + j];
}

// The variants share one, without the tensors.
struct Robot {
  pin::Model model;
  pin::Data data;

  explicit Robot(const Mechanism& mechanism) : model(make_model(mechanism)), data(model) {
    for (auto* tensor : {&data.d2tau_dqdq, &data.d2tau_dvdv, &data.d2tau_dqdv, &data.d2tau_dadq})
      *tensor = {};
  }
};

class Pinocchio final : public Peer {
 public:
  Pinocchio(const Mechanism& mechanism, pin::Convention convention, std::shared_ptr<Robot> robot)
      : mechanism_(mechanism),
        axes_(mechanism),
        convention_(convention),
        robot_(std::move(robot)),
        model_(robot_->model),
        data_(robot_->data) {}

  std::string name() const override {
    return std::string(is_local() ? "Pinocchio<LOCAL>@" : "Pinocchio<WORLD>@") + compiler_name;
  }
  std::string version() const override {
    return std::string("Pinocchio " PINOCCHIO_VERSION " (headers, ") + compiler_name + " " +
           compiler_version + ")";
  }
  // rnea, computeMinverse and computeABADerivatives have no convention.
  bool can(Task task) const override {
    return is_local() || task == Task::acceleration || task == Task::mass ||
           task == Task::mass_triangle;
  }

  void add_state(const double* q, const double* qd, const double* tau) override {
    State state = {Vector(mechanism_.nq),    axes_.to_library(q, qd),
                   axes_.to_library(q, tau), axes_.acceleration_to_library(q, qd, tau),
                   Vector(mechanism_.nq),    Vector(mechanism_.nv),
                   Vector(mechanism_.nv)};
    std::copy_n(q, mechanism_.nq, state.given_q.data());
    std::copy_n(qd, mechanism_.nv, state.given_qd.data());
    std::copy_n(tau, mechanism_.nv, state.given_tau.data());
    state.q = state.given_q;
    for (const Mechanism::Joint& joint : mechanism_.joints) {
      const bool is_free = joint.type == Mechanism::Type::free;
      if (!is_free && joint.type != Mechanism::Type::ball) {
        state.q[joint.q] -= joint.ref;
        continue;
      }
      const int at = joint.q + (is_free ? 3 : 0);
      state.q.segment<4>(at) = quaternion_at(q + at).coeffs();  // x, y, z, w
    }
    states_.push_back(state);
  }

  bool acceleration(int i) override {
    const State& state = states_[i];
    return pin::aba(model_, data_, state.q, state.qd, state.tau, convention_).allFinite();
  }
  bool inverse_dynamics(int i) override {
    const State& state = states_[i];
    pin::rnea(model_, data_, state.q, state.qd, state.qdd);
    return true;
  }
  bool inverse_triangle(int i) override {
    pin::computeMinverse(model_, data_, states_[i].q);
    matrix_is_mass_ = false;
    return true;
  }
  bool mass_triangle(int i) override {
    pin::crba(model_, data_, states_[i].q, convention_);
    matrix_is_mass_ = true;
    return true;
  }
  bool inverse(int i) override {
    inverse_triangle(i);
    mirror(data_.Minv);
    return true;
  }
  bool mass(int i) override {
    mass_triangle(i);
    mirror(data_.M);
    return true;
  }
  bool derivatives(int i) override {
    const State& state = states_[i];
    pin::computeABADerivatives(model_, data_, state.q, state.qd, state.tau);
    return true;
  }

  void get_acceleration(int i, double* a) const override {
    axes_.acceleration(states_[i].given_q.data(), states_[i].given_qd.data(), data_.ddq, a);
  }
  void get_torque(int i, double* tau) const override {
    axes_.torque(states_[i].given_q.data(), data_.tau, tau);
  }
  void get_matrix(int i, double* out) const override {
    if (matrix_is_mass_)
      mirror(data_.M);
    else
      mirror(data_.Minv);
    const double* const matrix = matrix_is_mass_ ? data_.M.data() : data_.Minv.data();
    const Eigen::Map<const Matrix> X(matrix, mechanism_.nv, mechanism_.nv);
    axes_.matrix(states_[i].given_q.data(), X, out);
  }
  void get_derivatives(int i, double* dq, double* dqd, double* dtau) const override {
    const State& state = states_[i];
    axes_.derivatives(state.given_q.data(), state.given_qd.data(), state.given_tau.data(),
                      data_.ddq, data_.ddq_dq, data_.ddq_dv, data_.Minv, dq, dqd, dtau);
  }

 private:
  struct State {
    Vector q, qd, tau, qdd, given_q, given_qd, given_tau;
  };

  bool is_local() const { return convention_ == pin::Convention::LOCAL; }
  int states() const override { return static_cast<int>(states_.size()); }

  const Mechanism& mechanism_;
  BodyAxes axes_;
  pin::Convention convention_;
  std::shared_ptr<Robot> robot_;
  const pin::Model& model_;
  pin::Data& data_;
  bool matrix_is_mass_ = false;  // of the last matrix
  std::vector<State> states_;
};

}  // namespace
}  // namespace kalmarm

void kalmarm_peers(const kalmarm::Mechanism& mechanism, kalmarm::Peers& peers) {
  using namespace kalmarm;
  if (mechanism.nv > largest_nv) return;
  const auto robot = std::make_shared<Robot>(mechanism);
  for (const pin::Convention convention : {pin::Convention::LOCAL, pin::Convention::WORLD})
    peers.push_back(std::make_unique<Pinocchio>(mechanism, convention, robot));
}
