// Flops of a call of the fast path, counted by running its sweeps once; sines and cosines are not
// counted. They do not depend on the state.
#pragma once

#include <vector>

#include "algorithms/fast/engine/forms.hpp"
#include "algorithms/fast/factors/lambda.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/spatial/count.hpp"

namespace kalmarm {

namespace detail {

template <class F>
double counted(const F& f) {
  Count::flops = 0;
  f();
  return static_cast<double>(Count::flops);
}

inline std::vector<Count> counts(const VectorX<double>& x) { return {x.begin(), x.end()}; }

}  // namespace detail

// Of one state's acceleration.
template <class Form>
double acceleration_flops(const Model<double>& parameters, const VectorX<double>& q,
                          const VectorX<double>& qd, const VectorX<double>& tau,
                          Zeros zeros = Zeros::left_out) {
  const LoweredModel<double> model(parameters, zeros);
  typename Form::template Workspace<Count> ws(model);
  const std::vector<Count> cq = detail::counts(q), cqd = detail::counts(qd),
                           ctau = detail::counts(tau);
  std::vector<Count> out(model.nv());
  return detail::counted(
      [&] { Form::acceleration(model, cq.data(), cqd.data(), ctau.data(), ws, out.data()); });
}

// Of one state's torques.
inline double inverse_dynamics_flops(const Model<double>& parameters, const VectorX<double>& q,
                                     Zeros zeros = Zeros::left_out) {
  const LoweredModel<double> model(parameters, zeros);
  InverseDynamicsWorkspace<Count> ws(model);
  const std::vector<Count> cq = detail::counts(q), zero(model.nv(), Count(0.0));
  std::vector<Count> out(model.nv());
  return detail::counted(
      [&] { fast_inverse_dynamics(model, cq.data(), zero.data(), zero.data(), ws, out.data()); });
}

// Of the factors, and of Lambda after them.
struct FactorFlops {
  double factors, lambda;
};

inline FactorFlops factor_flops(const Model<double>& parameters, const VectorX<double>& q,
                                Zeros zeros = Zeros::left_out) {
  const LoweredModel<double> model(parameters, zeros);
  FastFactors<Count> factors(model);
  LambdaWorkspace<Count> lambda(model);
  const std::vector<Count> cq = detail::counts(q);
  return {detail::counted([&] { covariance_factor(model, cq.data(), factors); }),
          detail::counted([&] { fast_lambda(model, factors, lambda); })};
}

}  // namespace kalmarm
