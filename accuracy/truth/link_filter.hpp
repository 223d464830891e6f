// The link-frame filter in one position, factored once, and what truth asks of it. Nothing here is
// proven: that is the enclosure's part (enclosure.hpp).
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "accuracy/truth/enclosure.hpp"
#include "accuracy/truth/truth.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/array.hpp"

namespace kalmarm {

// S: Real, at the precision in force, or long double.
template <class S>
class LinkFilter {
 public:
  LinkFilter(Model<S> model, const VectorX<S>& q)
      : model_(std::move(model)), kin_(model_), ws_(model_), zero_(VectorX<S>::Zero(model_.nv())) {
    set_position(model_, q, kin_);
    outcome_ = Variant::factor(model_, kin_, ws_);
  }

  const Outcome& outcome() const { return outcome_; }
  const std::vector<S>& D() const { return ws_.factors.D; }
  const std::vector<Vector6<S>>& g() const { return ws_.factors.g; }

  VectorX<S> acceleration(const VectorX<S>& qd, const VectorX<S>& tau, const Vector3<S>& gravity) {
    model_.set_gravity(gravity);
    set_velocity(model_, qd, kin_);
    VectorX<S> a(model_.nv());
    Variant::acceleration(model_, kin_, tau, ws_, a);
    return a;
  }

  // X tau
  VectorX<S> solve(const VectorX<S>& tau) { return acceleration(zero_, tau, Vector3<S>::Zero()); }

  MatrixX<S> inverse() {
    MatrixX<S> X(model_.nv(), model_.nv());
    Variant::inverse(model_, kin_, ws_, X);
    return X;
  }

  // Of X, without X: the covariance Lambda of the links' accelerations, outwards. With
  // y = Lambda- g, X(k,k) = 1 / D + g'y and Lambda+ = (1 - H'g') Lambda- (1 - g H) + H'H / D.
  VectorX<S> inverse_diagonal() const {
    std::vector<Matrix6<S>> Lambda(model_.nv());
    VectorX<S> X(model_.nv());
    for (int k = 0; k < model_.nv(); ++k) {
      const int parent = model_.parent(k), axis = model_.joint(k).axis();
      Lambda[k].setZero();
      if (parent >= 0) Lambda[k] = kin_.phi[k].dual_congruence(Lambda[parent]);
      const Vector6<S> y = Lambda[k] * g()[k];
      X[k] = 1 / D()[k] + g()[k].dot(y);
      Lambda[k].row(axis) -= y.transpose();
      Lambda[k].col(axis) -= y;
      Lambda[k](axis, axis) += X[k];
    }
    return X;
  }

  // (I + K) sqrt(D) eps: with y = sqrt(D) eps, tau = H z + y, z+ = z + g y
  VectorX<S> driven_by(const VectorX<S>& eps) const {
    using std::sqrt;
    std::vector<Vector6<S>> z(model_.nv(), Vector6<S>::Zero());
    VectorX<S> tau(model_.nv());
    for (int k = model_.nv() - 1; k >= 0; --k) {
      const S y = sqrt(D()[k]) * eps[k];
      tau[k] = z[k][model_.joint(k).axis()] + y;
      z[k] += g()[k] * y;
      if (const int parent = model_.parent(k); parent >= 0)
        z[parent] += kin_.phi[k].force_to_parent(z[k]);
    }
    return tau;
  }

 private:
  using Variant = Sequential<ArrayMGS>;

  Model<S> model_;
  LinkKinematics<S> kin_;
  typename Variant::template Workspace<S> ws_;
  VectorX<S> zero_;
  Outcome outcome_;
};

template <class T>
Vector3<Real> gravity_of(const Task<T>& task, const Model<T>& model) {
  if (!task.gravity) return Vector3<Real>::Zero();
  return model.gravity().template cast<Real>();
}

// tau of a task, rounded to T. Throws NoTruth where that is beyond the range of T.
template <class T, class S>
VectorX<T> torque_of(const Task<T>& task, const LinkFilter<S>& filter, const Enclosure& enclosure,
                     const Vector3<Real>& gravity) {
  const VectorX<Real> qd = task.qd.template cast<Real>();
  VectorX<Real> exact = task.value.template cast<Real>();
  if (task.drive == Drive::acceleration) exact = enclosure.torque(qd, exact, gravity);
  if (task.drive == Drive::innovations)
    exact = filter.driven_by(task.value.template cast<S>()).template cast<Real>() +
            enclosure.torque(qd, VectorX<Real>::Zero(qd.size()), gravity);
  const VectorX<T> tau = exact.template cast<T>();
  if (!tau.allFinite())
    throw NoTruth(NoTruth::Why::range, "the torque of a task is beyond the range of its precision");
  return tau;
}

}  // namespace kalmarm
