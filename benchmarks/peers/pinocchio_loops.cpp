// Pinocchio's constrained dynamics, of points between two bodies (CONTACT_3D), from its headers.
//
//   constraintDynamics   a Cholesky factor of the matrix of M and J, sparse as the tree is, and proximal steps with mu = 1e-8: three
//                        here; one_step: with mu = 1e-10 one, whose error, some mu, is within the bound
//   lcaba                bodies and loops eliminated in an order of least fill-in, O(n) of few loops
//   ConstraintCholesky   J M^-1 J' from the same factor, after crba. computeDelassusMatrix takes contacts with the world alone
//
// Accuracies are those from which on further proximal steps change nothing but rounding: constraintDynamics stops at what a step changes
// the forces by, of some 400 N here, lcaba at what J a is missed by. mu of lcaba is the best of its powers of ten: it adds
// stiffnesses 1 / mu to inertias, so that a smaller one costs digits, and a larger one steps.
#include <algorithm>
#include <pinocchio/algorithm/constrained-dynamics.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/loop-constrained-aba.hpp>
#include <utility>

#include "algorithms/model/plain.hpp"
#include "benchmarks/peers/loops.hpp"
#include "benchmarks/peers/pinocchio_model.hpp"

namespace kalmarm {
namespace {

namespace pin = pinocchio;

using Points = PINOCCHIO_STD_VECTOR_WITH_EIGEN_ALLOCATOR(pin::RigidConstraintModel);
using PointData = PINOCCHIO_STD_VECTOR_WITH_EIGEN_ALLOCATOR(pin::RigidConstraintData);

struct ClosedRobot {
  const Mechanism& mechanism;
  BodyAxes axes;
  pin::Model model;
  Points points;
  std::vector<PinocchioState> states;

  ClosedRobot(const Mechanism& of, const std::vector<Constraint>& loops,
              const std::vector<State>& given)
      : mechanism(of), axes(of), model(make_model<pin::JointCollectionDefaultTpl>(of)) {
    for (const Constraint& one : loops)
      points.emplace_back(pin::CONTACT_3D, model, joint_of(one.first.link), place(one.first),
                          joint_of(one.second.link), place(one.second), pin::LOCAL);
    for (const State& s : given)
      states.push_back(make_state(mechanism, axes, s.q.data(), s.qd.data(), s.tau.data()));
  }

 private:
  pin::JointIndex joint_of(int link) const {  // 0: the world
    for (std::size_t i = 0; i < mechanism.joints.size(); ++i)
      if (mechanism.last_dof(static_cast<int>(i)) == link) return i + 1;
    return 0;
  }
  static pin::SE3 place(const Frame& frame) {
    return {quaternion_of(frame.rotation).normalized().toRotationMatrix(),
            Eigen::Vector3d(frame.translation.data())};
  }
};

class Closed : public LoopPeer {
 public:
  explicit Closed(std::shared_ptr<const ClosedRobot> robot)
      : robot_(std::move(robot)),
        model_(robot_->model),
        points_(robot_->points),
        data_(model_),
        of_points_(points_.begin(), points_.end()) {}

 protected:
  VectorX<double> acceleration(int i) const {
    const PinocchioState& s = robot_->states[i];
    VectorX<double> out(model_.nv);
    robot_->axes.acceleration(s.given_q.data(), s.given_qd.data(), data_.ddq, out.data());
    return out;
  }
  // From rows in the axes of a point's first frame to rows in the base's.
  VectorX<double> turned(const Matrix& A) const {
    Matrix R = Matrix::Zero(A.rows(), A.rows());
    for (std::size_t k = 0; k < of_points_.size(); ++k)
      R.block<3, 3>(3 * k, 3 * k) = of_points_[k].oMc1.rotation();
    const RowMajor out = R * A * R.transpose();
    return Eigen::Map<const VectorX<double>>(out.data(), out.size());
  }
  int rows() const { return 3 * static_cast<int>(points_.size()); }

  std::shared_ptr<const ClosedRobot> robot_;
  const pin::Model& model_;
  const Points& points_;
  pin::Data data_;
  PointData of_points_;
};

class ConstraintDynamics final : public Closed {
 public:
  ConstraintDynamics(std::shared_ptr<const ClosedRobot> robot, int steps)
      : Closed(std::move(robot)), settings_(1e-6, 1e-6, steps == 1 ? 1e-10 : 1e-8, steps) {
    pin::initConstraintDynamics(model_, data_, points_, of_points_);
  }
  std::string name() const override {
    return settings_.max_iter == 1 ? "Pinocchio<constraintDynamics,one_step>"
                                   : "Pinocchio<constraintDynamics>";
  }
  void run(int i) override {
    const PinocchioState& s = robot_->states[i];
    pin::constraintDynamics(model_, data_, s.q, s.qd, s.tau, points_, of_points_, settings_);
  }
  VectorX<double> result(int i) const override { return acceleration(i); }

 private:
  pin::ProximalSettings settings_;
};

class Lcaba final : public Closed {
 public:
  explicit Lcaba(std::shared_ptr<const ClosedRobot> robot) : Closed(std::move(robot)) {
    pin::computeJointMinimalOrdering(model_, data_, points_);
  }
  std::string name() const override { return "Pinocchio<lcaba>"; }
  double stiffness() const override { return 1 / mu; }
  void run(int i) override {
    const PinocchioState& s = robot_->states[i];
    pin::lcaba(model_, data_, s.q, s.qd, s.tau, points_, of_points_, settings_);
  }
  VectorX<double> result(int i) const override { return acceleration(i); }

 private:
  static constexpr double mu = 1e-4;
  pin::ProximalSettings settings_{1e-5, 1e-5, mu, 20};
};

class ConstraintCholesky final : public Closed {
 public:
  explicit ConstraintCholesky(std::shared_ptr<const ClosedRobot> robot)
      : Closed(std::move(robot)), factor_(model_, data_, points_, of_points_), A_(rows(), rows()) {}
  std::string name() const override { return "Pinocchio<ConstraintCholesky>"; }
  void run(int i) override {
    pin::crba(model_, data_, robot_->states[i].q, pin::Convention::WORLD);
    pin::calc(model_, data_, points_, of_points_);
    factor_.compute(model_, data_, points_, of_points_, regular);
    factor_.getInverseOperationalSpaceInertiaMatrix(A_);
  }
  VectorX<double> result(int) const override {
    Matrix A = A_;
    A.diagonal().array() -= regular;
    return turned(A);
  }

 private:
  static constexpr double regular = 1e-8;  // rows of planar loops repeat each other
  pin::ConstraintCholeskyDecomposition factor_;
  Matrix A_;
};

}  // namespace

PeersOfLoops pinocchio_loops(const Mechanism& mechanism, const std::vector<Constraint>& points,
                             const std::vector<State>& states) {
  const auto robot = std::make_shared<const ClosedRobot>(mechanism, points, states);
  PeersOfLoops out;
  for (const int steps : {20, 1})
    out.accelerations.push_back(std::make_unique<ConstraintDynamics>(robot, steps));
  out.accelerations.push_back(std::make_unique<Lcaba>(robot));
  out.delassus.push_back(std::make_unique<ConstraintCholesky>(robot));
  return out;
}

}  // namespace kalmarm
