// A variant as a solver: kinematics, factors, and what check_finite adds to their outcome.
#pragma once

#include <concepts>
#include <limits>
#include <string>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/inverse_mass/refinement/refined_variant.hpp"
#include "algorithms/study/solver.hpp"

namespace kalmarm {

// The contract of a variant: factor the mass matrix of a state, then use the factors.
template <class V, class T>
concept InverseMass = std::constructible_from < typename V::template Workspace<T>,
const Model<T>& > &&requires(const Model<T>& model, const LinkKinematics<T>& kin,
                             typename V::template Workspace<T>& ws, const VectorX<T>& tau,
                             VectorX<T>& a, MatrixX<T>& X) {
  { V::name() } -> std::same_as<std::string>;
  { V::equation } -> std::convertible_to<std::string>;
  { V::factor(model, kin, ws) } -> std::same_as<Outcome>;
  { V::acceleration(model, kin, tau, ws, a) } -> std::same_as<void>;
  { V::solve(model, kin, tau, ws, a) } -> std::same_as<void>;
  { V::inverse(model, kin, ws, X) } -> std::same_as<void>;
};

template <class V, class T>
requires InverseMass<V, T>
class SolverOf final : public Solver<T> {
 public:
  explicit SolverOf(const Model<T>& model)
      : model_(model), kin_(model_), composite_(model_), ws_(model_) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    set_position(model_, q, kin_);
    set_velocity(model_, qd, kin_);
    Outcome outcome = V::factor(model_, kin_, ws_);
    if (!outcome) return outcome;
    V::acceleration(model_, kin_, tau, ws_, a);
    report_refinement(ws_, outcome);
    return check_finite(a, outcome);
  }

  Outcome factor(const VectorX<T>& q) override {
    set_position(model_, q, kin_);
    return V::factor(model_, kin_, ws_);
  }

  void solve(const VectorX<T>& tau, VectorX<T>& x) override { V::solve(model_, kin_, tau, ws_, x); }

  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    const Outcome outcome = factor(q);
    if (!outcome) return outcome;
    V::inverse(model_, kin_, ws_, X);
    return check_finite(X, outcome);
  }

  bool has_factors() const override { return filters; }

  Outcome factors(const VectorX<T>& q, VectorX<T>& D, MatrixX<T>& g) override {
    const Outcome outcome = factor(q);
    if constexpr (filters) {
      for (int k = 0; k < model_.nv(); ++k) {
        D[k] = ws_.factors.D[k];
        g.col(k) = ws_.factors.g[k];
      }
    }
    return outcome;
  }

  void mass(const VectorX<T>& q, MatrixX<T>& M) override {
    set_position(model_, q, kin_);
    mass_matrix(model_, kin_, composite_, Eigen::Ref<MatrixX<T>>(M));
  }

  Vector6<T> P_plus_times(int k, const Vector6<T>& x) const override {
    if constexpr (filters)
      return std::decay_t<decltype(ws_.factors)>::Update::P_plus_times(k, x, ws_.factors.update);
    else
      return Vector6<T>::Constant(std::numeric_limits<T>::quiet_NaN());
  }

 private:
  static constexpr bool filters = requires(typename V::template Workspace<T> ws) { ws.factors.D; };

  template <class Result>
  static Outcome check_finite(const Result& result, const Outcome& outcome) {
    return result.allFinite() ? outcome : Outcome{.status = Outcome::Status::not_finite};
  }

  Model<T> model_;
  LinkKinematics<T> kin_;
  CompositeInertia<T> composite_;
  typename V::template Workspace<T> ws_;
};

}  // namespace kalmarm
