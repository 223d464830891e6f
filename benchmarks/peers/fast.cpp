// Kalmarm's fast path as a contender, through the one door, so that one program can time what two
// compilers make of it. The test for singularity and its Outcome are part of every call.
#include <algorithm>
#include <array>
#include <type_traits>

#include "algorithms/dynamics/plan.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/flops/flops.hpp"
#include "benchmarks/peers/peer.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/kinematics.hpp"

namespace kalmarm {
namespace {

template <class T>
class Fast final : public Peer {
 public:
  Fast(const Model<double>& model, const std::vector<Frame>& tips, std::optional<double> tolerance)
      : refined_(tolerance.has_value()),
        robot_(plain(model),
               {.tolerance = tolerance,
                .question = {.want = {Want::acceleration, Want::inverse_dynamics, Want::inverse,
                                      Want::mass, Want::derivatives}}}),
        lower_(plain(model), {.tolerance = tolerance,
                              .question = {.want = {Want::inverse, Want::mass}},
                              .triangles = Triangles::lower}),
        tips_(plain(model),
              {.tolerance = tolerance, .question = {.want = {Want::operational}, .frames = tips}}),
        kinematics_(plain(model), {{model.nv() - 1}}),
        nq_(model.nq()),
        nv_(model.nv()),
        a_(nv_),
        torque_(nv_),
        matrix_(nv_, nv_),
        dq_(matrix_),
        dqd_(matrix_),
        dtau_(matrix_),
        columns_(nv_, 6),
        operational_(6 * tips.size(), 6 * tips.size()),
        regressor_(nv_, 10 * nv_),
        parameters_(10 * nv_),
        armature_(nv_) {
    for (int k = 0; k < nv_; ++k) {
      const RigidBody<double>& body = model.joint(k).body;
      const Vector3<double>& c = body.com;
      const Matrix3<double> I =
          model.inertia(k).I_cm +
          body.mass * (c.squaredNorm() * Matrix3<double>::Identity() - c * c.transpose());
      parameters_.segment<10>(10 * k) << body.mass, body.mass * c, I(0, 0), I(1, 1), I(2, 2),
          I(0, 1), I(0, 2), I(1, 2);
      armature_[k] = model.joint(k).r;
    }
  }

  std::string name() const override {
    return std::string(refined_ ? "Ladder<last_bits>" : "Ladder<default>") + KALMARM_PEER_TAG;
  }
  std::string version() const override { return ""; }
  bool is_float32() const override { return std::is_same_v<T, float>; }
  bool can(Task task) const override {
    return !refined_ || task == Task::acceleration || task == Task::inverse;
  }
  bool has_batch(Task task) const override { return !is_triangle(task); }
  double flops(Task task, bool batch) const override {
    if (is_kinematics(task) || task == Task::regressor || (task != Task::acceleration && refined_))
      return 0;
    if (task == Task::operational)
      return kalmarm::flops(tips_.plan(), Want::operational, tips_.tolerance(), {.rows = batch});
    return kalmarm::flops(robot_.plan(), want(task), robot_.tolerance(), {.rows = batch});
  }

  void add_state(const double* q, const double* qd, const double* tau) override {
    const auto put = [](const double* x, int n, std::vector<VectorX<T>>& vectors,
                        std::vector<T>& rows) {
      vectors.push_back(Eigen::Map<const VectorX<double>>(x, n).cast<T>());
      rows.insert(rows.end(), vectors.back().begin(), vectors.back().end());
    };
    put(q, nq_, q_, q_rows_);
    put(qd, nv_, qd_, qd_rows_);
    put(tau, nv_, tau_, tau_rows_);
    outcomes_.resize(q_.size());
  }

  bool acceleration(int i) override {
    batched_ = false;
    return static_cast<bool>(robot_.forward_dynamics(q_[i], qd_[i], tau_[i], a_));
  }
  bool batch(Task task) override {
    batched_ = true;
    rows_.resize(q_.size() * numbers(task));
    switch (task) {
      case Task::acceleration:
        return robot_.forward_dynamics(q_rows_, qd_rows_, tau_rows_, rows_, outcomes_) == 0;
      case Task::inverse_dynamics:
        robot_.inverse_dynamics(q_rows_, qd_rows_, tau_rows_, rows_, 1);
        return true;
      case Task::inverse:
        return robot_.inverse_mass(q_rows_, rows_, outcomes_) == 0;
      case Task::mass:
        return robot_.mass(q_rows_, rows_, outcomes_) == 0;
      case Task::inverse_triangle:
      case Task::mass_triangle:
        return false;
      case Task::frame: {
        const auto [columns, points, rotations] = rows_of_kinematics();
        kinematics_.compute_rows(
            q_rows_, {.positions = points, .rotations = rotations, .jacobians = columns});
        return true;
      }
      case Task::momentum: {
        const auto [columns, points, rotations] = rows_of_kinematics();
        kinematics_.compute_rows(q_rows_, {.center = points, .momentum_matrix = columns});
        return true;
      }
      case Task::regressor:
        kinematics_.compute_rows(q_rows_, qd_rows_, tau_rows_, {.regressor = RowsView<T>(rows_)});
        return true;
      case Task::operational:
        return tips_.operational(q_rows_, rows_, outcomes_) == 0;
      case Task::derivatives: {
        const auto count = static_cast<std::ptrdiff_t>(q_.size());
        for (std::vector<T>* X : {&dq_rows_, &dqd_rows_, &dtau_rows_}) X->resize(count * nv_ * nv_);
        return robot_.derivatives(q_rows_, qd_rows_, tau_rows_,
                                  {.dq = RowsView<T>(dq_rows_),
                                   .dqd = RowsView<T>(dqd_rows_),
                                   .dtau = RowsView<T>(dtau_rows_)},
                                  rows_, outcomes_) == 0;
      }
    }
    return false;
  }
  bool inverse_dynamics(int i) override {
    batched_ = false;
    robot_.inverse_dynamics(q_[i], qd_[i], tau_[i], torque_);
    return true;
  }
  bool inverse_triangle(int i) override {
    batched_ = false;
    is_lower_ = true;
    return static_cast<bool>(lower_.inverse_mass(q_[i], matrix_));
  }
  bool mass_triangle(int i) override {
    batched_ = false;
    is_lower_ = true;
    lower_.mass(q_[i], matrix_);
    return true;
  }
  bool inverse(int i) override {
    batched_ = is_lower_ = false;
    return static_cast<bool>(robot_.inverse_mass(q_[i], matrix_));
  }
  bool mass(int i) override {
    batched_ = is_lower_ = false;
    robot_.mass(q_[i], matrix_);
    return true;
  }
  bool derivatives(int i) override {
    batched_ = false;
    return static_cast<bool>(
        robot_.derivatives(q_[i], qd_[i], tau_[i], {.dq = dq_, .dqd = dqd_, .dtau = dtau_}, a_));
  }
  bool frame(int i) override {
    batched_ = false;
    kinematics_.compute(q_[i],
                        {.positions = point_, .rotations = rotation_, .jacobians = columns_});
    return true;
  }
  bool momentum(int i) override {
    batched_ = false;
    kinematics_.compute(q_[i], {.center = point_, .momentum_matrix = columns_});
    return true;
  }
  bool operational(int i) override {
    batched_ = false;
    return static_cast<bool>(tips_.operational(q_[i], operational_));
  }
  bool regressor(int i) override {
    batched_ = false;
    kinematics_.compute(q_[i], qd_[i], tau_[i], {.regressor = regressor_});
    return true;
  }
  void get_regressed_torque(int i, double* tau) const override {
    const std::ptrdiff_t size = regressor_.size();
    const T* const Y = batched_ ? &rows_[i * size] : regressor_.data();
    Eigen::Map<VectorX<double>>(tau, nv_) =
        Eigen::Map<const MatrixX<T>>(Y, nv_, 10 * nv_).template cast<double>() * parameters_ +
        armature_.cwiseProduct(tau_[i].template cast<double>());
  }
  void get_operational(int i, double* out) const override {
    const std::ptrdiff_t size = operational_.size();
    std::copy_n(batched_ ? &rows_[i * size] : operational_.data(), size, out);  // symmetric
  }
  void get_columns(int i, double* out) const override {
    std::copy_n(batched_ ? &rows_[i * nv_ * 6] : columns_.data(), nv_ * 6,
                out);  // of J', by columns
  }
  void get_torque(int i, double* tau) const override {
    std::copy_n(batched_ ? &rows_[i * nv_] : torque_.data(), nv_, tau);
  }
  void get_matrix(int i, double* out) const override {
    const std::ptrdiff_t size = std::ptrdiff_t(nv_) * nv_;
    if (batched_)
      std::copy_n(&rows_[i * size], size, out);  // symmetric
    else
      put_symmetric(out);
  }
  void get_derivatives(int i, double* dq, double* dqd, double* dtau) const override {
    put(dq_, dq_rows_, i, dq);
    put(dqd_, dqd_rows_, i, dqd);
    put(dtau_, dtau_rows_, i, dtau);
  }
  void get_acceleration(int i, double* a) const override {
    std::copy_n(batched_ ? &rows_[i * nv_] : a_.data(), nv_, a);
  }

 private:
  // Of a state's result.
  std::size_t numbers(Task task) const {
    switch (task) {
      case Task::inverse:
      case Task::mass:
        return matrix_.size();
      case Task::frame:
      case Task::momentum:
        return columns_.size();
      case Task::operational:
        return operational_.size();
      case Task::regressor:
        return regressor_.size();
      default:
        return nv_;
    }
  }
  static Want want(Task task) {
    switch (task) {
      case Task::acceleration:
        return Want::acceleration;
      case Task::inverse_dynamics:
        return Want::inverse_dynamics;
      case Task::inverse:
      case Task::inverse_triangle:
        return Want::inverse;
      case Task::mass:
      case Task::mass_triangle:
        return Want::mass;
      case Task::derivatives:
        return Want::derivatives;
      case Task::frame:
      case Task::momentum:
      case Task::operational:
      case Task::regressor:
        break;
    }
    return Want::acceleration;
  }
  void put_symmetric(double* out) const {
    MatrixX<double> X = matrix_.template cast<double>();
    if (is_lower_) X.template triangularView<Eigen::StrictlyUpper>() = X.transpose();
    std::copy_n(X.data(), X.size(), out);
  }
  // Of one state, or state i of rows.
  void put(const MatrixX<T>& one, const std::vector<T>& rows, std::ptrdiff_t i, double* out) const {
    const T* const x = batched_ ? &rows[i * nv_ * nv_] : one.data();
    Eigen::Map<MatrixX<double>>(out, nv_, nv_) =
        Eigen::Map<const MatrixX<T>>(x, nv_, nv_).transpose().template cast<double>();
  }
  int states() const override { return static_cast<int>(q_.size()); }

  // J' or A', positions, rotations.
  std::array<RowsView<T>, 3> rows_of_kinematics() {
    points_.resize(3 * q_.size());
    rotations_.resize(9 * q_.size());
    return {RowsView<T>(rows_), RowsView<T>(points_), RowsView<T>(rotations_)};
  }

  bool refined_;
  Dynamics<T> robot_, lower_, tips_;
  Kinematics<T> kinematics_;
  int nq_, nv_;
  std::vector<VectorX<T>> q_, qd_, tau_;
  std::vector<T> q_rows_, qd_rows_, tau_rows_;
  std::vector<T> rows_, dq_rows_, dqd_rows_, dtau_rows_, points_,
      rotations_;  // what the last batch has left
  std::vector<Outcome> outcomes_;
  VectorX<T> a_, torque_;
  MatrixX<T> matrix_, dq_, dqd_, dtau_, columns_, operational_, regressor_;
  VectorX<double> parameters_, armature_;
  Vector3<T> point_;
  Matrix3<T> rotation_;
  bool batched_ = false, is_lower_ = false;  // the last call
};

}  // namespace
}  // namespace kalmarm

void kalmarm_peers(const kalmarm::Mechanism& mechanism, kalmarm::Peers& peers) {
  using namespace kalmarm;
  const Model<double>& model = *mechanism.model;
  std::vector<Frame> tips;
  for (const int tip : mechanism.tips()) tips.push_back({mechanism.last_dof(tip)});
  for (const std::optional<double> tolerance : {std::optional<double>(), {last_bits}}) {
    peers.push_back(std::make_unique<Fast<double>>(model, tips, tolerance));
    peers.push_back(std::make_unique<Fast<float>>(model, tips, tolerance));
  }
}
