// A variant of the study as an engine of Dynamics: the same questions, asked in the same way, of
// whatever can factor M.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"

namespace kalmarm {

// What the solver does not have, M and inverse dynamics, is that of model/. It has no derivatives.
template <class T>
class SolverState {
 public:
  SolverState(const Model<T>& model, std::unique_ptr<Solver<T>> solver)
      : model_(model),
        solver_(std::move(solver)),
        kin_(model_),
        composite_(model_),
        newton_euler_(model_),
        q_(model.nq()),
        qd_(model.nv()),
        tau_(model.nv()),
        a_(model.nv()) {}

  Outcome answer(const Call<T>& call) {
    switch (call.want) {
      case Want::acceleration:
        if (call.B || call.r) none("columns or joint noise with accelerations");
        return acceleration(call);
      case Want::inverse_dynamics:
        return inverse_dynamics(call);
      case Want::mass:
        return mass(call);
      case Want::inverse:
        return inverse(call);
      case Want::solve: {
        const Outcome of_D = factor(call);
        return of_D ? solve(1, call.tau, call.out) : of_D;
      }
      default:
        none(to_string(call.want));
    }
  }

  Outcome factor(const Call<T>& call) {
    std::copy_n(call.q, q_.size(), q_.data());
    return kept_ = solver_->factor(q_);
  }

  Outcome solve(int columns, const T* taus, T* X) {
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

 private:
  [[noreturn]] static void none(const char* what) {
    throw std::logic_error(std::string("variants of the study do not give ") + what);
  }

  Outcome acceleration(const Call<T>& call) {
    set(call);
    const Outcome out = solver_->acceleration(q_, qd_, tau_, a_);
    std::copy_n(a_.data(), a_.size(), call.out);
    return out;
  }

  Outcome inverse_dynamics(const Call<T>& call) {
    set(call);
    set_position(model_, q_, kin_);
    set_velocity(model_, qd_, kin_);
    kalmarm::inverse_dynamics(model_, kin_, tau_, newton_euler_, Eigen::Ref<VectorX<T>>(a_));
    std::copy_n(a_.data(), a_.size(), call.out);
    return {};
  }

  Outcome mass(const Call<T>& call) {
    std::copy_n(call.q, q_.size(), q_.data());
    set_position(model_, q_, kin_);
    const int nv = model_.nv();
    Eigen::Map<MatrixX<T>> M(call.out, nv, nv);
    mass_matrix(model_, kin_, composite_, Eigen::Ref<MatrixX<T>>(M));
    const bool finite = M.allFinite();
    return {.status = finite ? Outcome::Status::ok : Outcome::Status::not_finite};
  }

  Outcome inverse(const Call<T>& call) {
    std::copy_n(call.q, q_.size(), q_.data());
    if (X_.size() == 0) X_.resize(model_.nv(), model_.nv());
    const Outcome out = solver_->inverse(q_, X_);
    std::copy_n(X_.data(), X_.size(), call.out);
    return out;
  }

  void set(const Call<T>& call) {
    std::copy_n(call.q, q_.size(), q_.data());
    std::copy_n(call.qd, qd_.size(), qd_.data());
    std::copy_n(call.tau, tau_.size(), tau_.data());
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

template <class T>
class SolverEngine final : public Engine<T> {
 public:
  using Make = std::function<std::unique_ptr<Solver<T>>(const Model<T>&)>;

  SolverEngine(const Model<T>& model, Make make) : model_(model), make_(std::move(make)) {
    SolverEngine::reserve_workers(Want::acceleration, 1);
  }

  bool answers_in_part() const override { return false; }
  Outcome answer(const Call<T>& call) override { return workers_[0]->answer(call); }
  Outcome factor(const Call<T>& call) override { return workers_[0]->factor(call); }
  Outcome solve(int columns, const T* taus, T* X) override {
    return workers_[0]->solve(columns, taus, X);
  }

  void reserve_workers(Want, int count) override {
    while (static_cast<int>(workers_.size()) < count)
      workers_.push_back(std::make_unique<SolverState<T>>(model_, make_(model_)));
  }

  void answer_rows(int worker, int count, const Call<T>& call, Outcome* outcomes) override {
    const Widths width{model_.nq(), model_.nv(), model_.nv(), 0};
    for (int i = 0; i < count; ++i) {
      const Outcome out = workers_[worker]->answer(call.from(i, width));
      if (outcomes) outcomes[i] = out;
    }
  }

 private:
  Model<T> model_;
  Make make_;
  std::vector<std::unique_ptr<SolverState<T>>> workers_;
};

// make(model), which is kept, is a solver of every part, in precision T.
template <class T, class Make>
MakeEngine<T> engines_by(const Make& make) {
  return
      [make](const RobotModel& robot, const EngineOptions& options) -> std::unique_ptr<Engine<T>> {
        if (!options.frames.acted_on.empty() || !options.frames.contacts.empty() ||
            !options.frames.loaded.empty())
          throw std::invalid_argument(
              "solvers of the study take no forces from outside and no contacts");
        const Model<T> model = model_of(robot).cast<T>();
        return std::make_unique<SolverEngine<T>>(model, make);
      };
}

}  // namespace kalmarm
