#include "accuracy/truth/truth.hpp"

#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "accuracy/truth/enclosure.hpp"
#include "accuracy/truth/structured_condition.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/array.hpp"

namespace kalmarm {
namespace {

constexpr double required_width = 1e-25;

// The link-frame filter, factored once.
class Filter {
 public:
  Filter(Model<Real> model, const VectorX<Real>& q)
      : model_(std::move(model)),
        kin_(model_),
        ws_(model_),
        zero_(VectorX<Real>::Zero(model_.nv())) {
    set_position(model_, q, kin_);
    outcome_ = Variant::factor(model_, kin_, ws_);
  }

  const Model<Real>& model() const { return model_; }
  const Outcome& outcome() const { return outcome_; }
  const std::vector<Real>& D() const { return ws_.factors.D; }
  const std::vector<Vector6<Real>>& g() const { return ws_.factors.g; }

  VectorX<Real> acceleration(const VectorX<Real>& qd, const VectorX<Real>& tau,
                             const Vector3<Real>& gravity) {
    model_.set_gravity(gravity);
    set_velocity(model_, qd, kin_);
    VectorX<Real> a(model_.nv());
    Variant::acceleration(model_, kin_, tau, ws_, a);
    return a;
  }

  // X tau
  VectorX<Real> solve(const VectorX<Real>& tau) {
    return acceleration(zero_, tau, Vector3<Real>::Zero());
  }

  MatrixX<Real> inverse() {
    MatrixX<Real> X(model_.nv(), model_.nv());
    Variant::inverse(model_, kin_, ws_, X);
    return X;
  }

  // Of X, without X: the covariance Lambda of the links' accelerations, outwards. With
  // y = Lambda- g, X(k,k) = 1 / D + g'y and Lambda+ = (1 - H'g') Lambda- (1 - g H) + H'H / D.
  VectorX<Real> inverse_diagonal() const {
    std::vector<Matrix6<Real>> Lambda(model_.nv());
    VectorX<Real> X(model_.nv());
    for (int k = 0; k < model_.nv(); ++k) {
      const int parent = model_.parent(k), axis = model_.joint(k).axis();
      Lambda[k].setZero();
      if (parent >= 0) Lambda[k] = kin_.phi[k].dual_congruence(Lambda[parent]);
      const Vector6<Real> y = Lambda[k] * g()[k];
      X[k] = 1 / D()[k] + g()[k].dot(y);
      Lambda[k].row(axis) -= y.transpose();
      Lambda[k].col(axis) -= y;
      Lambda[k](axis, axis) += X[k];
    }
    return X;
  }

  // (I + K) sqrt(D) eps: with y = sqrt(D) eps, tau = H z + y, z+ = z + g y
  VectorX<Real> driven_by(const VectorX<Real>& eps) const {
    std::vector<Vector6<Real>> z(model_.nv(), Vector6<Real>::Zero());
    VectorX<Real> tau(model_.nv());
    for (int k = model_.nv() - 1; k >= 0; --k) {
      const Real y = sqrt(D()[k]) * eps[k];
      tau[k] = z[k][model_.joint(k).axis()] + y;
      z[k] += g()[k] * y;
      if (const int parent = model_.parent(k); parent >= 0)
        z[parent] += kin_.phi[k].force_to_parent(z[k]);
    }
    return tau;
  }

 private:
  using Variant = Sequential<ArrayMGS>;

  Model<Real> model_;
  LinkKinematics<Real> kin_;
  Variant::Workspace<Real> ws_;
  VectorX<Real> zero_;
  Outcome outcome_;
};

// tau of a task, not yet rounded.
template <class T>
VectorX<Real> torque(const Task<T>& task, const Filter& filter, const Enclosure& enclosure,
                     const Vector3<Real>& gravity) {
  const VectorX<Real> value = task.value.template cast<Real>(), qd = task.qd.template cast<Real>();
  switch (task.drive) {
    case Drive::acceleration:
      return enclosure.torque(qd, value, gravity);
    case Drive::innovations:
      return filter.driven_by(value) +
             enclosure.torque(qd, VectorX<Real>::Zero(value.size()), gravity);
    case Drive::torque:
      break;
  }
  return value;
}

// M, X, D and g.
template <class T>
void set_matrices(const Enclosure& enclosure, Filter& filter, Truth<T>& out) {
  const auto nv = static_cast<Eigen::Index>(filter.D().size());
  out.M = enclosure.mass();
  out.X = filter.inverse();
  out.D = Eigen::Map<const VectorX<Real>>(filter.D().data(), nv);
  out.g.resize(6, nv);
  for (Eigen::Index k = 0; k < nv; ++k) out.g.col(k) = filter.g()[k];
  out.width = {enclosure.mass_width(out.M), enclosure.inverse_width(out.X),
               enclosure.D_width(out.D), enclosure.g_width(out.g)};
}

// At the precision in force.
template <class T>
Truth<T> attempt(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
                 unsigned digits, const TruthOptions& options) {
  Truth<T> out;
  out.digits = digits;
  Filter filter(model.template cast<Real>(), q.template cast<Real>());
  out.outcome = filter.outcome();
  if (!out.outcome) return out;

  const BallDigits centres;
  const Enclosure enclosure(model, q, filter.inverse_diagonal());
  if (options.matrices) set_matrices(enclosure, filter, out);
  for (const Task<T>& task : tasks) {
    Vector3<Real> gravity = Vector3<Real>::Zero();
    if (task.gravity) gravity = model.gravity().template cast<Real>();
    Response<T>& response = out.responses.emplace_back();
    response.tau = torque(task, filter, enclosure, gravity).template cast<T>();
    if (!response.tau.allFinite())
      throw std::runtime_error("the torque of a task is beyond the range of its precision");
    const VectorX<Real> qd = task.qd.template cast<Real>(),
                        tau = response.tau.template cast<Real>();
    response.a = filter.acceleration(qd, tau, gravity);
    response.width = enclosure.acceleration_width(qd, tau, gravity, response.a);
  }

  if (options.draws > 0 && out.largest_width() <= required_width) {
    const Solve solve = [&](const VectorX<Real>& r) {
      return options.matrices ? VectorX<Real>(out.X * r) : filter.solve(r);
    };
    const std::vector<StructuredCondition> kS =
        structured_condition(model, q, tasks, out.responses, solve, digits, options.draws);
    for (std::size_t i = 0; i < kS.size(); ++i) out.responses[i].kS = kS[i];
  }
  return out;
}

// log10 of the ratio of the largest to the smallest mass.
template <class T>
double mass_range(const Model<T>& model) {
  double low = std::numeric_limits<double>::infinity(), high = 0;
  for (int k = 0; k < model.nv(); ++k)
    if (const double mass = model.joint(k).body.mass; mass > 0) {
      low = std::min(low, mass);
      high = std::max(high, mass);
    }
  return high > 0 ? std::log10(high) - std::log10(low) : 0;
}

}  // namespace

template <class T>
double Truth<T>::largest_width() const {
  double worst = std::max({width.M, width.X, width.D, width.g});
  for (const Response<T>& response : responses)
    worst = std::max({worst, response.width.relative, response.width.energy});
  return worst;
}

template <class T>
Truth<T> truth(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
               const TruthOptions& options) {
  Truth<T> out;
  const double start = 40 + 4 * std::log10(model.nv()) + 2 * mass_range(model);
  const unsigned first = std::min(options.digits, static_cast<unsigned>(std::ceil(start)));
  for (unsigned digits = first; digits <= options.digits; digits *= 2) {
    const Digits precision(digits);
    out = attempt(model, q, tasks, digits, options);
    if (out.outcome && out.largest_width() <= required_width) return out;
  }
  if (!out.outcome) return out;
  std::ostringstream what;
  what << "no truth within " << options.digits << " digits: with " << out.digits
       << " it is proven to no more than " << out.largest_width();
  throw std::runtime_error(what.str());
}

template struct Truth<float>;
template struct Truth<double>;
template Truth<float> truth(const Model<float>&, const VectorX<float>&,
                            const std::vector<Task<float>>&, const TruthOptions&);
template Truth<double> truth(const Model<double>&, const VectorX<double>&,
                             const std::vector<Task<double>>&, const TruthOptions&);

}  // namespace kalmarm
