#include "accuracy/adversary/exact.hpp"

#include <cmath>
#include <stdexcept>

#include "accuracy/truth/displaced.hpp"
#include "accuracy/truth/move.hpp"
#include "accuracy/truth/truth.hpp"
#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/array.hpp"

namespace kalmarm::adversary {
namespace {

constexpr int draws = 3;  // for kS
constexpr unsigned most_digits = 400;

MatrixX<Real> mass(const Model<Real>& model, const VectorX<Real>& q) {
  LinkKinematics<Real> kin(model);
  CompositeInertia<Real> ws(model);
  MatrixX<Real> M(model.nv(), model.nv());
  set_position(model, q, kin);
  mass_matrix(model, kin, ws, Eigen::Ref<MatrixX<Real>>(M));
  return M;
}

// M^-1, its diagonal or log det M.
template <class T>
Answer<Real> of_inverse(Want task, const Truth<T>& truth) {
  if (task == Want::inverse) return {truth.X};
  if (task == Want::diagonal) return {truth.X.diagonal()};
  MatrixX<Real> log_det = MatrixX<Real>::Zero(1, 1);
  for (const Real& D : truth.D) log_det(0) += log(D);
  return {log_det};
}

// (2)
template <class T>
double condition_of_inverse(Want task, const Model<T>& model, const VectorX<T>& q,
                            const Truth<T>& truth, const Answer<Real>& answer) {
  const Digits precision(2 * truth.digits);
  const Real delta = pow(Real(10), -static_cast<int>(truth.digits));
  const Model<Real> exact = model.template cast<Real>();
  const VectorX<Real> position = q.template cast<Real>();
  const MatrixX<Real>& X = truth.X;
  const MatrixX<Real> M = mass(exact, position);
  Move<Real> move(delta, 1);
  double sum = 0;
  for (int draw = 0; draw < draws; ++draw) {
    const Model<Real> moved = move.moved(exact);
    const MatrixX<Real> X_dM = X * (mass(moved, move.moved(position)) - M) / delta;
    Answer<Real> difference = {MatrixX<Real>::Constant(1, 1, X_dM.trace())};
    if (task == Want::inverse) difference = {X_dM * X};
    if (task == Want::diagonal) difference = {(X_dM * X).diagonal()};
    const double error = error_of(task, difference, answer);
    sum += error * error;
  }
  return std::sqrt(sum / draws);
}

// (1), at the precision in force.
class Differences {
 public:
  Differences(const Model<Real>& model, const VectorX<Real>& q, const VectorX<Real>& qd,
              const VectorX<Real>& tau, const Real& h)
      : model_(model), q_(q), qd_(qd), h_(h), kin_(model), moved_(model), ws_(model), id_(model) {
    set_position(model, q, kin_);
    set_velocity(model, qd, kin_);
    if (!Filter::factor(model, kin_, ws_)) return;
    a_.resize(model.nv());
    Filter::acceleration(model, kin_, tau, ws_, a_);
    torque_ = torque(q, qd);
  }

  // Empty where M has no inverse.
  Answer<Real> derivatives() {
    const int nv = model_.nv();
    if (a_.size() == 0) return {};
    MatrixX<Real> dq(nv, nv), dqd(nv, nv), dtau(nv, nv);
    for (int k = 0; k < nv; ++k) {
      VectorX<Real> faster = qd_;
      faster[k] += h_;
      dq.col(k) = answer_to(torque(displaced(model_, q_, k, h_), qd_));
      dqd.col(k) = answer_to(torque(q_, faster));
    }
    Filter::inverse(model_, kin_, ws_, dtau);
    return {dq, dqd, dtau};
  }

 private:
  using Filter = Sequential<ArrayMGS>;

  VectorX<Real> torque(const VectorX<Real>& q, const VectorX<Real>& qd) {
    VectorX<Real> tau(model_.nv());
    set_position(model_, q, moved_);
    set_velocity(model_, qd, moved_);
    inverse_dynamics(model_, moved_, a_, id_, Eigen::Ref<VectorX<Real>>(tau));
    return tau;
  }

  VectorX<Real> answer_to(const VectorX<Real>& torque) {
    VectorX<Real> da(model_.nv());
    Filter::solve(model_, kin_, VectorX<Real>((torque_ - torque) / h_), ws_, da);
    return da;
  }

  const Model<Real>& model_;
  const VectorX<Real>&q_, &qd_;
  Real h_;
  LinkKinematics<Real> kin_, moved_;
  Filter::Workspace<Real> ws_;
  InverseDynamics<Real> id_;
  VectorX<Real> a_, torque_;
};

Answer<long double> rounded(const Answer<Real>& answer) {
  Answer<long double> out;
  for (const MatrixX<Real>& x : answer) out.push_back(x.cast<long double>());
  return out;
}

template <class T>
Exact known_answer(Want task, const Mechanism& mechanism, bool with_kS) {
  const Model<T> model = mechanism.model.template cast<T>();
  const State& state = mechanism.state;
  const VectorX<T> q = state.q.cast<T>(), qd = state.qd.cast<T>(), tau = state.tau.cast<T>();
  Task<T> asked{tau, qd};
  if (task == Want::solve) asked = {tau, VectorX<T>::Zero(tau.size()), Drive::torque, false};
  const bool of_M = task == Want::inverse || task == Want::diagonal || task == Want::log_det;
  const Truth<T> truth = kalmarm::truth<T>(
      model, q, of_M ? std::vector<Task<T>>() : std::vector<Task<T>>{asked},
      {.digits = most_digits, .matrices = of_M, .draws = with_kS && !of_M ? draws : 0});
  Exact out;
  if (!truth.outcome) return out;
  if (of_M) {
    const Answer<Real> answer = of_inverse(task, truth);
    out.answer = rounded(answer);
    if (with_kS) out.kS = condition_of_inverse(task, model, q, truth, answer);
    return out;
  }
  if (with_kS) out.kS = truth.responses[0].kS.relative;
  if (task != Want::derivatives) {
    if (!truth.responses[0].a.isZero(Real(0))) out.answer = rounded({truth.responses[0].a});
    return out;
  }
  const Digits precision(2 * truth.digits);
  const Model<Real> exact = model.template cast<Real>();
  out.answer =
      rounded(Differences(exact, q.template cast<Real>(), qd.template cast<Real>(),
                          tau.template cast<Real>(), pow(Real(10), -static_cast<int>(truth.digits)))
                  .derivatives());
  return out;
}

}  // namespace

template <class T>
Exact exact_answer(Want task, const Mechanism& mechanism, bool with_kS) {
  try {
    return known_answer<T>(task, mechanism, with_kS);
  } catch (const std::runtime_error&) {  // not within the digits
    return {};
  }
}

template Exact exact_answer<float>(Want, const Mechanism&, bool);
template Exact exact_answer<double>(Want, const Mechanism&, bool);

}  // namespace kalmarm::adversary
