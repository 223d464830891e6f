// A variant of the study as an engine of Dynamics: the same questions, asked in the same way, of
// whatever can factor M.
#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"

namespace kalmarm {

// What the solver does not have, M and inverse dynamics, is that of model/. It has no derivatives,
// and no rows on several cores.
template <class T>
class SolverEngine final : public Engine<T> {
 public:
  SolverEngine(const Model<T>& model, std::unique_ptr<Solver<T>> solver)
      : model_(model),
        solver_(std::move(solver)),
        kin_(model_),
        composite_(model_),
        newton_euler_(model_),
        q_(model.nq()),
        qd_(model.nv()),
        tau_(model.nv()),
        a_(model.nv()) {}

  bool answers_in_part() const override { return false; }

  Outcome forward_dynamics(const T* q, const T* qd, const T* tau, T* a) override {
    set(q, qd, tau);
    const Outcome out = solver_->acceleration(q_, qd_, tau_, a_);
    std::copy_n(a_.data(), a_.size(), a);
    return out;
  }

  void reserve_workers(Want what, int count) override {
    const bool has_rows = what == Want::acceleration || what == Want::inverse_dynamics;
    if (has_rows && count > 1) throw std::logic_error("variants of the study answer on one core");
  }

  int forward_dynamics(int, int count, const T* q, const T* qd, const T* tau, T* a,
                       Outcome* outcomes) override {
    const std::ptrdiff_t nq = model_.nq(), nv = model_.nv();
    int failed = 0;
    for (int i = 0; i < count; ++i) {
      outcomes[i] = forward_dynamics(q + i * nq, qd + i * nv, tau + i * nv, a + i * nv);
      failed += !outcomes[i];
    }
    return failed;
  }

  void inverse_dynamics(int, int count, const T* q, const T* qd, const T* qdd, T* tau) override {
    const std::ptrdiff_t nq = model_.nq(), nv = model_.nv();
    for (int i = 0; i < count; ++i)
      inverse_dynamics(q + i * nq, qd + i * nv, qdd + i * nv, tau + i * nv);
  }

  void inverse_dynamics(const T* q, const T* qd, const T* qdd, T* tau) override {
    set(q, qd, qdd);
    set_position(model_, q_, kin_);
    set_velocity(model_, qd_, kin_);
    kalmarm::inverse_dynamics(model_, kin_, tau_, newton_euler_, Eigen::Ref<VectorX<T>>(a_));
    std::copy_n(a_.data(), a_.size(), tau);
  }

  void mass(const T* q, T* M) override {
    std::copy_n(q, q_.size(), q_.data());
    set_position(model_, q_, kin_);
    const int nv = model_.nv();
    mass_matrix(model_, kin_, composite_,
                Eigen::Ref<MatrixX<T>>(Eigen::Map<MatrixX<T>>(M, nv, nv)));
  }

  Outcome inverse(const T* q, T* X) override {
    std::copy_n(q, q_.size(), q_.data());
    if (X_.size() == 0) X_.resize(model_.nv(), model_.nv());
    const Outcome out = solver_->inverse(q_, X_);
    std::copy_n(X_.data(), X_.size(), X);
    return out;
  }

  Outcome factor(const T* q) override {
    std::copy_n(q, q_.size(), q_.data());
    return kept_ = solver_->factor(q_);
  }

  Outcome solve(int columns, const T* taus, T* X) override {
    const std::ptrdiff_t nv = model_.nv();
    bool finite = true;
    for (int j = 0; j < columns; ++j) {
      std::copy_n(taus + j * nv, nv, tau_.data());
      solver_->solve(tau_, a_);
      finite = finite && a_.allFinite();
      std::copy_n(a_.data(), nv, X + j * nv);
    }
    return finite ? kept_ : Outcome{.status = Outcome::Status::not_finite};
  }

  Outcome diagonal(const T*, T*) override { none("the diagonal alone"); }
  Outcome log_det(const T*, T&) override { none("log det M alone"); }
  Outcome selected(const T*, T*) override { none("chosen blocks alone"); }
  Outcome derivatives(const T*, const T*, const T*, T*, T*, T*, T*) override {
    none("derivatives");
  }

 private:
  [[noreturn]] static void none(const char* what) {
    throw std::logic_error(std::string("variants of the study do not give ") + what);
  }

  void set(const T* q, const T* qd, const T* tau_or_qdd) {
    std::copy_n(q, q_.size(), q_.data());
    std::copy_n(qd, qd_.size(), qd_.data());
    std::copy_n(tau_or_qdd, tau_.size(), tau_.data());
  }

  Model<T> model_;
  std::unique_ptr<Solver<T>> solver_;
  LinkKinematics<T> kin_;
  CompositeInertia<T> composite_;
  InverseDynamics<T> newton_euler_;
  VectorX<T> q_, qd_, tau_, a_;
  MatrixX<T> X_;
  Outcome kept_;
};

// make(model) is a solver of every part, in precision T.
template <class T, class Make>
MakeEngine<T> engines_by(const Make& make) {
  return [make](const RobotModel& robot, const EngineOptions&) -> std::unique_ptr<Engine<T>> {
    const Model<T> model = model_of(robot).cast<T>();
    return std::make_unique<SolverEngine<T>>(model, make(model));
  };
}

}  // namespace kalmarm
