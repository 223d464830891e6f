// Kalmarm's fast path as a contender, so that one program can time what two compilers make of it.
// The singularity test and its Outcome are part of every call.
#include <algorithm>
#include <type_traits>

#include "algorithms/structured/derivatives.hpp"
#include "algorithms/structured/dynamics.hpp"
#include "algorithms/structured/flops.hpp"
#include "algorithms/structured/inverse.hpp"
#include "algorithms/structured/inverse_dynamics.hpp"
#include "algorithms/structured/mass.hpp"
#include "benchmarks/peers/peer.hpp"

namespace kalmarm {
namespace {

template <class T, class Form>
class Structured final : public Peer {
 public:
  explicit Structured(const Model<double>& model)
      : model_(model),
        one_(model.cast<T>()),
        batch_(model.cast<T>()),
        inverse_dynamics_(model.cast<T>()),
        inverse_(model.cast<T>()),
        mass_(model.cast<T>()),
        derivatives_(model.cast<T>()),
        a_(model.nv()),
        torque_(model.nv()),
        matrix_(model.nv(), model.nv()),
        dq_(matrix_),
        dqd_(matrix_),
        dtau_(matrix_) {}

  std::string name() const override {
    constexpr bool root = std::is_same_v<Form, SquareRootForm>;
    return std::string(root ? "StructuredSquareRoot" : "Structured") + KALMARM_PEER_TAG;
  }
  std::string version() const override { return ""; }
  bool is_float32() const override { return std::is_same_v<T, float>; }
  bool can(Task task) const override {
    const bool has_forms =
        task == Task::acceleration || task == Task::acceleration_batch || task == Task::inverse;
    return has_forms || std::is_same_v<Form, CovarianceForm>;
  }
  bool has_batch() const override { return true; }
  double flops(Task task) const override {
    if (task != Task::acceleration && task != Task::acceleration_batch) return 0;
    return acceleration_flops<Form>(model_, q_[0].template cast<double>(),
                                    qd_[0].template cast<double>(),
                                    tau_[0].template cast<double>());
  }

  void add_state(const double* q, const double* qd, const double* tau) override {
    const auto put = [](const double* x, int n, std::vector<VectorX<T>>& vectors,
                        std::vector<T>& rows) {
      vectors.push_back(Eigen::Map<const VectorX<double>>(x, n).cast<T>());
      rows.insert(rows.end(), vectors.back().begin(), vectors.back().end());
    };
    put(q, model_.nq(), q_, q_rows_);
    put(qd, model_.nv(), qd_, qd_rows_);
    put(tau, model_.nv(), tau_, tau_rows_);
    a_rows_.resize(q_.size() * model_.nv());
    outcomes_.resize(q_.size());
  }

  bool acceleration(int i) override {
    batched_ = false;
    return static_cast<bool>(one_.acceleration(q_[i], qd_[i], tau_[i], a_));
  }
  bool acceleration_batch() override {
    batched_ = true;
    return batch_.acceleration(states(), q_rows_.data(), qd_rows_.data(), tau_rows_.data(),
                               a_rows_.data(), outcomes_.data()) == 0;
  }
  bool inverse_dynamics(int i) override {
    inverse_dynamics_.inverse_dynamics(q_[i], qd_[i], tau_[i], torque_);
    return true;
  }
  bool inverse(int i) override { return static_cast<bool>(inverse_.inverse(q_[i], matrix_)); }
  bool mass(int i) override {
    mass_.mass(q_[i], matrix_);
    return true;
  }
  bool derivatives(int i) override {
    return static_cast<bool>(
        derivatives_.derivatives(q_[i], qd_[i], tau_[i], dq_, dqd_, dtau_, a_));
  }
  void get_torque(int, double* tau) const override {
    std::copy_n(torque_.data(), model_.nv(), tau);
  }
  void get_matrix(int, double* out) const override { put(matrix_, out); }
  void get_derivatives(int, double* dq, double* dqd, double* dtau) const override {
    put(dq_, dq);
    put(dqd_, dqd);
    put(dtau_, dtau);
  }
  void get_acceleration(int i, double* a) const override {
    std::copy_n(batched_ ? &a_rows_[i * model_.nv()] : a_.data(), model_.nv(), a);
  }

 private:
  static void put(const MatrixX<T>& x, double* out) {
    Eigen::Map<MatrixX<double>>(out, x.rows(), x.cols()) = x.transpose().template cast<double>();
  }
  int states() const override { return static_cast<int>(q_.size()); }

  const Model<double>& model_;
  StructuredDynamics<T, Form> one_;
  StructuredBatch<T, Form> batch_;
  StructuredInverseDynamics<T> inverse_dynamics_;
  StructuredInverse<T, Form> inverse_;
  StructuredMass<T> mass_;
  StructuredDerivatives<T> derivatives_;
  std::vector<VectorX<T>> q_, qd_, tau_;
  std::vector<T> q_rows_, qd_rows_, tau_rows_, a_rows_;
  std::vector<Outcome> outcomes_;
  VectorX<T> a_, torque_;
  MatrixX<T> matrix_, dq_, dqd_, dtau_;
  bool batched_ = false;
};

}  // namespace
}  // namespace kalmarm

void kalmarm_peers(const kalmarm::Mechanism& mechanism, kalmarm::Peers& peers) {
  using namespace kalmarm;
  const Model<double>& model = *mechanism.model;
  peers.push_back(std::make_unique<Structured<double, CovarianceForm>>(model));
  peers.push_back(std::make_unique<Structured<float, CovarianceForm>>(model));
  peers.push_back(std::make_unique<Structured<double, SquareRootForm>>(model));
  peers.push_back(std::make_unique<Structured<float, SquareRootForm>>(model));
}
