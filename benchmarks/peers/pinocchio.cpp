// Pinocchio from its headers, with the compiler and the flags that Kalmarm's own code has; its
// library is not linked. A variant for each convention of aba and crba.
//
//   acceleration      aba
//   inverse_dynamics  rnea
//   inverse           computeMinverse, which fills the upper triangle, and its mirror image
//   mass              crba, the same
//   TASK_triangle     without the mirror image
//   derivatives       computeABADerivatives
//   frame             computeFrameJacobian, the fastest for one frame
//   momentum          ccrba
//   operational       computeMinverse, and its products with J: of legged robots 1.1 to 1.2 times as fast as crba, its
//                     Cholesky and a solve of J', of iiwa14 0.8
//   regressor         computeJointTorqueRegressor
// Results stay in pinocchio::Data.
#include <algorithm>
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/centroidal.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include "benchmarks/peers/body_axes.hpp"
#include "benchmarks/peers/pinocchio_model.hpp"

namespace kalmarm {
namespace {

namespace pin = pinocchio;

// Data allocates four tensors of nv^3 numbers: 4 GB at 500, for a moment.
constexpr int largest_nv = 512;

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
  pin::FrameIndex last;  // the frame of the last body
  pin::Data data;

  explicit Robot(const Mechanism& mechanism)
      : model(make_model<pin::JointCollectionDefaultTpl>(mechanism)),
        last(model.addFrame(
            pin::Frame("last", model.njoints - 1, 0, pin::SE3::Identity(), pin::OP_FRAME))),
        data(model) {
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
        data_(robot_->data),
        J_(6, mechanism.nv),
        tips_(mechanism.tips()),
        J_tips_(Matrix::Zero(6 * tips_.size(), mechanism.nv)),
        solved_(mechanism.nv, J_tips_.rows()),
        operational_(J_tips_.rows(), J_tips_.rows()) {
    J_.setZero();
  }

  std::string name() const override {
    return std::string(is_local() ? "Pinocchio<LOCAL>@" : "Pinocchio<WORLD>@") + compiler_name;
  }
  std::string version() const override {
    return std::string("Pinocchio " PINOCCHIO_VERSION " (headers, ") + compiler_name + " " +
           compiler_version + ")";
  }
  // The others have no convention.
  bool can(Task task) const override {
    return is_local() || task == Task::acceleration || task == Task::mass ||
           task == Task::mass_triangle;
  }

  void add_state(const double* q, const double* qd, const double* tau) override {
    states_.push_back(make_state(mechanism_, axes_, q, qd, tau));
  }

  bool acceleration(int i) override {
    const PinocchioState& state = states_[i];
    return pin::aba(model_, data_, state.q, state.qd, state.tau, convention_).allFinite();
  }
  bool inverse_dynamics(int i) override {
    const PinocchioState& state = states_[i];
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
    const PinocchioState& state = states_[i];
    pin::computeABADerivatives(model_, data_, state.q, state.qd, state.tau);
    return true;
  }

  bool frame(int i) override {
    pin::computeFrameJacobian(model_, data_, states_[i].q, robot_->last, pin::LOCAL_WORLD_ALIGNED,
                              J_);
    columns_ = &J_;
    return true;
  }
  bool momentum(int i) override {
    pin::ccrba(model_, data_, states_[i].q, states_[i].qd);
    columns_ = &data_.Ag;
    return true;
  }

  bool operational(int i) override {
    pin::computeMinverse(model_, data_, states_[i].q);
    pin::computeJointJacobians(model_, data_, states_[i].q);
    for (std::size_t k = 0; k < tips_.size(); ++k)
      pin::getJointJacobian(model_, data_, tips_[k] + 1, pin::LOCAL,
                            J_tips_.middleRows<6>(6 * static_cast<int>(k)));
    solved_.noalias() = data_.Minv.selfadjointView<Eigen::Upper>() * J_tips_.transpose();
    operational_.noalias() = J_tips_ * solved_;
    return true;
  }

  bool regressor(int i) override {
    const PinocchioState& state = states_[i];
    pin::computeJointTorqueRegressor(model_, data_, state.q, state.qd, state.qdd);
    return true;
  }

  void get_regressed_torque(int i, double* tau) const override {
    Vector parameters(10 * (model_.njoints - 1));
    for (int k = 1; k < model_.njoints; ++k)
      parameters.segment<10>(10 * (k - 1)) = model_.inertias[k].toDynamicParameters();
    axes_.torque(
        states_[i].given_q.data(),
        data_.jointTorqueRegressor * parameters + model_.armature.cwiseProduct(states_[i].qdd),
        tau);
  }
  void get_operational(int, double* out) const override {
    const auto size = operational_.rows();
    const auto row = [](Eigen::Index i) { return i / 6 * 6 + (i + 3) % 6; };  // angular first
    for (Eigen::Index i = 0; i < size; ++i)
      for (Eigen::Index k = 0; k < size; ++k) *out++ = operational_(row(i), row(k));
  }
  void get_columns(int i, double* out) const override {
    Matrix X(6, mechanism_.nv);
    X << columns_->bottomRows(3), columns_->topRows(3);
    axes_.columns(states_[i].given_q.data(), X, out);
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
    const PinocchioState& state = states_[i];
    axes_.derivatives(state.given_q.data(), state.given_qd.data(), state.given_tau.data(),
                      data_.ddq, data_.ddq_dq, data_.ddq_dv, data_.Minv, dq, dqd, dtau);
  }

 private:
  bool is_local() const { return convention_ == pin::Convention::LOCAL; }
  int states() const override { return static_cast<int>(states_.size()); }

  const Mechanism& mechanism_;
  BodyAxes axes_;
  pin::Convention convention_;
  std::shared_ptr<Robot> robot_;
  const pin::Model& model_;
  pin::Data& data_;
  pin::Data::Matrix6x J_;
  const pin::Data::Matrix6x* columns_ = &J_;
  bool matrix_is_mass_ = false;  // of the last matrix
  std::vector<int> tips_;
  Matrix J_tips_, solved_, operational_;
  std::vector<PinocchioState> states_;
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
