#include "accuracy/truth/structured_condition.hpp"

#include <cassert>
#include <cmath>

#include "accuracy/measures/measures.hpp"
#include "accuracy/truth/move.hpp"
#include "algorithms/model/inverse_dynamics.hpp"

namespace kalmarm {
namespace {

// States that need no more digits take half the time (FixedReal), or a thirtieth of it.
constexpr unsigned fixed_digits = 160, wide_digits = 18;

// A model in one position, with one velocity after another.
template <class S>
class Dynamics {
 public:
  Dynamics(Model<S> model, const VectorX<S>& q)
      : model_(std::move(model)), kin_(model_), ws_(model_), gravity_(model_.gravity()) {
    set_position(model_, q, kin_);
  }

  // ID(a)
  VectorX<S> torque(const VectorX<S>& qd, const VectorX<S>& a, bool gravity) {
    model_.set_gravity(gravity ? gravity_ : Vector3<S>(Vector3<S>::Zero()));
    const bool at_rest = qd.isZero(S(0));
    if (!(at_rest && at_rest_)) set_velocity(model_, qd, kin_);
    at_rest_ = at_rest;
    VectorX<S> tau(model_.nv());
    inverse_dynamics(model_, kin_, a, ws_, Eigen::Ref<VectorX<S>>(tau));
    return tau;
  }

 private:
  Model<S> model_;
  LinkKinematics<S> kin_;
  InverseDynamics<S> ws_;
  Vector3<S> gravity_;
  bool at_rest_ = false;  // kin_ is
};

template <class S>
struct Reference {
  VectorX<S> qd, tau, a, torque;  // torque: ID(a)
  Real relative = 0, energy = 0;  // |a|^2 in both norms
  Real sum = 0, energy_sum = 0;   // of |da|^2
};

template <class S, class T>
std::vector<StructuredCondition> condition_in(const Model<T>& model, const VectorX<T>& q,
                                              const std::vector<Task<T>>& tasks,
                                              const std::vector<Response<T>>& responses,
                                              const Solve& solve, unsigned digits, int draws,
                                              std::uint64_t seed) {
  using std::pow;
  const S delta = pow(S(10), -static_cast<int>(digits));
  const Model<S> exact = model.template cast<S>();
  const VectorX<S> position = q.template cast<S>(), zero = VectorX<S>::Zero(model.nv());

  std::vector<Reference<S>> references;
  Dynamics<S> dynamics(exact, position);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    Reference<S>& at = references.emplace_back();
    at.qd = tasks[i].qd.template cast<S>();
    at.tau = responses[i].tau.template cast<S>();
    at.a = responses[i].a.template cast<S>();
    at.torque = dynamics.torque(at.qd, at.a, tasks[i].gravity);
    at.relative = Real(at.a.squaredNorm());
    at.energy = Real(at.a.dot(dynamics.torque(zero, at.a, false)));  // (2)
  }

  Move<S> move(delta, seed);
  for (int draw = 0; draw < draws; ++draw) {
    Dynamics<S> moved(move.moved(exact), move.moved(position));
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      Reference<S>& at = references[i];
      const VectorX<S> dtau = move.moved(at.tau) - at.tau;
      const VectorX<S> dID = moved.torque(move.moved(at.qd), at.a, tasks[i].gravity) - at.torque;
      const VectorX<Real> r = VectorX<S>(dtau - dID).template cast<Real>();  // (1)
      const VectorX<Real> da = solve(r);
      at.sum += da.squaredNorm();
      at.energy_sum += da.dot(r);  // (2)
    }
  }

  std::vector<StructuredCondition> out;
  out.reserve(tasks.size());
  const Real scale = Real(delta) * sqrt(Real(draws));
  for (const Reference<S>& at : references)
    out.push_back({quotient(sqrt(at.sum), scale * sqrt(at.relative)),
                   quotient(sqrt(at.energy_sum), scale * sqrt(at.energy))});
  return out;
}

}  // namespace

template <class T>
std::vector<StructuredCondition> structured_condition(const Model<T>& model, const VectorX<T>& q,
                                                      const std::vector<Task<T>>& tasks,
                                                      const std::vector<Response<T>>& responses,
                                                      const Solve& solve, unsigned digits,
                                                      int draws, std::uint64_t seed) {
  assert(tasks.size() == responses.size() && draws > 0);
  const bool fixed = 2 * digits <= fixed_digits, wide = 2 * digits <= wide_digits;
  const Digits precision(fixed ? digits : 2 * digits);
  return (wide    ? condition_in<long double, T>
          : fixed ? condition_in<FixedReal<fixed_digits>, T>
                  : condition_in<Real, T>)(model, q, tasks, responses, solve, digits, draws, seed);
}

template std::vector<StructuredCondition> structured_condition(
    const Model<float>&, const VectorX<float>&, const std::vector<Task<float>>&,
    const std::vector<Response<float>>&, const Solve&, unsigned, int, std::uint64_t);
template std::vector<StructuredCondition> structured_condition(
    const Model<double>&, const VectorX<double>&, const std::vector<Task<double>>&,
    const std::vector<Response<double>>&, const Solve&, unsigned, int, std::uint64_t);

}  // namespace kalmarm
