#include "accuracy/truth.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "accuracy/inverse_check.hpp"
#include "accuracy/measures.hpp"
#include "accuracy/structured_condition.hpp"
#include "accuracy/world_mechanics.hpp"
#include "algorithms/inverse_mass/sequential.hpp"
#include "algorithms/riccati/array.hpp"

namespace kalmarm {
namespace {

constexpr double agreement = 1e-25;
constexpr int probes = 4;

// The link-frame filter, factored once.
class Filter {
 public:
  Filter(Model<Real> model, const VectorX<Real>& q)
      : model_(std::move(model)),
        rm_(model_),
        ws_(model_),
        zero_(VectorX<Real>::Zero(model_.nv())) {
    set_position(model_, q, rm_);
    outcome_ = Variant::factor(model_, rm_, ws_);
  }

  const Model<Real>& model() const { return model_; }
  const Outcome& outcome() const { return outcome_; }
  const std::vector<Real>& D() const { return ws_.factors.D; }
  const std::vector<Vector6<Real>>& g() const { return ws_.factors.g; }

  VectorX<Real> acceleration(const VectorX<Real>& qd, const VectorX<Real>& tau,
                             const Vector3<Real>& gravity) {
    model_.set_gravity(gravity);
    set_velocity(model_, qd, rm_);
    VectorX<Real> a(model_.nv());
    Variant::acceleration(model_, rm_, tau, ws_, a);
    return a;
  }

  // X tau
  VectorX<Real> solve(const VectorX<Real>& tau) {
    return acceleration(zero_, tau, Vector3<Real>::Zero());
  }

  MatrixX<Real> inverse() {
    MatrixX<Real> X(model_.nv(), model_.nv());
    Variant::inverse(model_, rm_, ws_, X);
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
        z[parent] += rm_.phi[k].force_to_parent(z[k]);
    }
    return tau;
  }

 private:
  using Variant = Sequential<ArrayMGS>;

  Model<Real> model_;
  RandomModel<Real> rm_;
  Variant::Workspace<Real> ws_;
  VectorX<Real> zero_;
  Outcome outcome_;
};

// tau of a task, not yet rounded.
template <class T>
VectorX<Real> torque(const Task<T>& task, const Filter& filter, const WorldMechanics& world,
                     const Vector3<Real>& gravity) {
  const VectorX<Real> value = task.value.template cast<Real>(), qd = task.qd.template cast<Real>();
  switch (task.drive) {
    case Drive::acceleration:
      return world.torque(qd, value, gravity);
    case Drive::innovations:
      return filter.driven_by(value) + world.torque(qd, VectorX<Real>::Zero(value.size()), gravity);
    case Drive::torque:
      break;
  }
  return value;
}

// M, X, D and g; the return value is (2).
template <class T>
double set_matrices(const WorldMechanics& world, Filter& filter, int dense, Truth<T>& out) {
  out.M = world.mass();
  out.X = filter.inverse();
  const auto nv = static_cast<Eigen::Index>(filter.D().size());
  out.D = Eigen::Map<const VectorX<Real>>(filter.D().data(), nv);
  out.g.resize(6, nv);
  for (Eigen::Index k = 0; k < nv; ++k) out.g.col(k) = filter.g()[k];
  if (nv > dense) return probed_residual(out.M, out.X, probes);
  const std::optional<MatrixX<Real>> X_world = ldl_inverse(out.M);
  return X_world ? matrix_error(*X_world, out.X).scaled : std::numeric_limits<double>::infinity();
}

// Both algorithms at the precision in force.
template <class T>
Truth<T> attempt(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
                 unsigned digits, const TruthOptions& options) {
  Truth<T> out;
  out.digits = digits;
  const VectorX<Real> position = q.template cast<Real>();
  Filter filter(model.template cast<Real>(), position);
  out.outcome = filter.outcome();
  if (!out.outcome) return out;

  const WorldMechanics world(filter.model(), position);
  if (options.matrices) out.disagreement = set_matrices(world, filter, options.dense, out);
  const Solve solve = [&](const VectorX<Real>& r) {
    return options.matrices ? VectorX<Real>(out.X * r) : filter.solve(r);
  };
  for (const Task<T>& task : tasks) {
    Vector3<Real> gravity = Vector3<Real>::Zero();
    if (task.gravity) gravity = model.gravity().template cast<Real>();
    Response<T>& response = out.responses.emplace_back();
    response.tau = torque(task, filter, world, gravity).template cast<T>();
    if (!response.tau.allFinite())
      throw std::runtime_error("the torque of a task is beyond the range of its precision");
    const VectorX<Real> qd = task.qd.template cast<Real>(),
                        tau = response.tau.template cast<Real>();
    response.a = filter.acceleration(qd, tau, gravity);
    const VectorX<Real> error = solve(tau - world.torque(qd, response.a, gravity));  // (1)
    out.disagreement = larger(out.disagreement, quotient(error.norm(), response.a.norm()));
  }

  if (options.draws > 0 && out.disagreement <= agreement) {
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
Truth<T> truth(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
               const TruthOptions& options) {
  Truth<T> out;
  const double start = 40 + 4 * std::log10(model.nv()) + 2 * mass_range(model);
  const unsigned first = std::min(options.digits, static_cast<unsigned>(std::ceil(start)));
  for (unsigned digits = first; digits <= options.digits; digits *= 2) {
    const Digits precision(digits);
    out = attempt(model, q, tasks, digits, options);
    if (out.outcome && out.disagreement <= agreement) return out;
  }
  if (!out.outcome) return out;
  std::ostringstream what;
  what << "no truth within " << options.digits << " digits: with " << out.digits
       << " two algorithms still differ by " << out.disagreement;
  throw std::runtime_error(what.str());
}

template Truth<float> truth(const Model<float>&, const VectorX<float>&,
                            const std::vector<Task<float>>&, const TruthOptions&);
template Truth<double> truth(const Model<double>&, const VectorX<double>&,
                             const std::vector<Task<double>>&, const TruthOptions&);

}  // namespace kalmarm
