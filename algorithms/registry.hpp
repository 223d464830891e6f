// THE list of variants: benchmarks, accuracy and tests all walk it. A new variant is one line here.
// To use variants include solver.hpp, which is light; to compile them for a scalar, this.
#pragma once

#include <concepts>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/inverse_mass/batch.hpp"
#include "algorithms/inverse_mass/closed_form.hpp"
#include "algorithms/inverse_mass/eigen_cholesky.hpp"
#include "algorithms/inverse_mass/factored_bias.hpp"
#include "algorithms/inverse_mass/mixed_precision.hpp"
#include "algorithms/inverse_mass/openblas.hpp"
#include "algorithms/inverse_mass/refined.hpp"
#include "algorithms/inverse_mass/sequential.hpp"
#include "algorithms/inverse_mass/sparse_ltdl.hpp"
#include "algorithms/inverse_mass/stacked_qr.hpp"
#include "algorithms/inverse_mass/wide_refined.hpp"
#include "algorithms/riccati/array.hpp"
#include "algorithms/riccati/conventional.hpp"
#include "algorithms/riccati/ud.hpp"
#include "algorithms/riccati/world_frame.hpp"
#include "algorithms/solver.hpp"

namespace kalmarm {

template <class... Vs>
struct VariantList {
  // f.template operator()<V>() for every variant V.
  template <class F>
  static void for_each(F&& f) {
    (f.template operator()<Vs>(), ...);
  }
};

// What an engineer may want to choose: timed everywhere.
using Contenders = VariantList<Batch<EigenLLT>,                     //
                               Batch<EigenLDLT>,                    //
                               Batch<OpenBLAS>,                     //
                               Batch<SparseLTDL>,                   //
                               Sequential<Conventional>,            //
                               ClosedForm<Conventional>,            //
                               Sequential<ArrayMGS>,                //
                               Sequential<ArrayGivens>,             //
                               Sequential<UD>,                      //
                               FactoredBias<ArrayGivens>,           //
                               Refined<Sequential<Zeroed>>,         //
                               Refined<FactoredBias<ArrayGivens>>,  //
                               WideRefined<FactoredBias<ArrayGivens>>>;

// What is known, recommended or feared elsewhere, for the accuracy laboratory: in float32 and
// float64 alone, since nothing is to be learnt of rounding in multi-precision.
using Exhibits = VariantList<StackedQR,                                  //
                             Refined<Batch<EigenLLT>>,                   //
                             WideRefined<Sequential<Conventional>>,      //
                             WideRefined<FactoredBias<ArrayMGS>>,        //
                             Sequential<Joseph>,                         //
                             Sequential<Zeroed>,                         //
                             Sequential<Potter>,                         //
                             Sequential<ArrayHouseholder>,               //
                             Sequential<ArrayPivoted>,                   //
                             ClosedForm<ArrayMGS>,                       //
                             FactoredBias<ArrayMGS>,                     //
                             FactoredBias<ArrayHouseholder>,             //
                             Refined<Sequential<Conventional>>,          //
                             Refined<Sequential<Joseph>>,                //
                             Refined<Sequential<ArrayMGS>>,              //
                             Refined<Sequential<ArrayGivens>>,           //
                             Refined<FactoredBias<ArrayMGS>>,            //
                             MixedPrecision<Sequential<Conventional>>,   //
                             MixedPrecision<Sequential<ArrayMGS>>,       //
                             MixedPrecision<FactoredBias<ArrayGivens>>,  //
                             Sequential<WorldAxes<Conventional>>,        //
                             Sequential<WorldAxes<Joseph>>,              //
                             Sequential<WorldAxes<Potter>>,              //
                             Sequential<WorldAxes<ArrayHouseholder>>,    //
                             Sequential<WorldAxes<ArrayPivoted>>,        //
                             Sequential<WorldAxes<ArrayMGS>>,            //
                             Sequential<WorldAxes<ArrayGivens>>,         //
                             Sequential<WorldAxes<UD>>,                  //
                             Sequential<WorldOrigin<Conventional>>,      //
                             Sequential<WorldOrigin<Joseph>>,            //
                             Sequential<WorldOrigin<Potter>>,            //
                             Sequential<WorldOrigin<ArrayHouseholder>>,  //
                             Sequential<WorldOrigin<ArrayPivoted>>,      //
                             Sequential<WorldOrigin<ArrayMGS>>,          //
                             Sequential<WorldOrigin<ArrayGivens>>,       //
                             Sequential<WorldOrigin<UD>>>;

// The contract of a variant: factor the mass matrix of a state, then use the factors.
template <class V, class T>
concept InverseMass = std::constructible_from < typename V::template Workspace<T>,
const Model<T>& > &&requires(const Model<T>& model, const RandomModel<T>& rm,
                             typename V::template Workspace<T>& ws, const VectorX<T>& tau,
                             VectorX<T>& a, MatrixX<T>& X) {
  { V::name() } -> std::same_as<std::string>;
  { V::equation } -> std::convertible_to<std::string>;
  { V::factor(model, rm, ws) } -> std::same_as<Outcome>;
  { V::acceleration(model, rm, tau, ws, a) } -> std::same_as<void>;
  { V::solve(model, rm, tau, ws, a) } -> std::same_as<void>;
  { V::inverse(model, rm, ws, X) } -> std::same_as<void>;
};

template <class V, class T>
requires InverseMass<V, T>
class SolverOf final : public Solver<T> {
 public:
  explicit SolverOf(const Model<T>& model) : model_(model), rm_(model_), ws_(model_) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    set_position(model_, q, rm_);
    set_velocity(model_, qd, rm_);
    Outcome outcome = V::factor(model_, rm_, ws_);
    if (!outcome) return outcome;
    V::acceleration(model_, rm_, tau, ws_, a);
    report_refinement(ws_, outcome);
    return check_finite(a, outcome);
  }

  Outcome factor(const VectorX<T>& q) override {
    set_position(model_, q, rm_);
    return V::factor(model_, rm_, ws_);
  }

  void solve(const VectorX<T>& tau, VectorX<T>& x) override { V::solve(model_, rm_, tau, ws_, x); }

  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    const Outcome outcome = factor(q);
    if (!outcome) return outcome;
    V::inverse(model_, rm_, ws_, X);
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
  RandomModel<T> rm_;
  typename V::template Workspace<T> ws_;
};

template <class T>
std::vector<RegisteredVariant<T>> registered_variants() {
  std::vector<RegisteredVariant<T>> out;
  bool contender = true;
  const auto add = [&]<class V>() {
    if constexpr (V::template supports<T>)
      out.push_back({V::name(), V::equation, contender, [](const Model<T>& model) {
                       return std::unique_ptr<Solver<T>>(std::make_unique<SolverOf<V, T>>(model));
                     }});
  };
  Contenders::for_each(add);
  if constexpr (std::is_floating_point_v<T>) {
    for (RegisteredVariant<T>& variant : structured_variants<T>()) out.push_back(variant);
    contender = false;
    Exhibits::for_each(add);
  }
  return out;
}

}  // namespace kalmarm
