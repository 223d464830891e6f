// THE list of variants: benchmarks, accuracy and tests all walk it. A new variant is one line here.
// To use variants include solver.hpp, which is light; to compile them for a scalar, this.
#pragma once

#include <concepts>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/inverse_mass/batch.hpp"
#include "algorithms/inverse_mass/closed_form.hpp"
#include "algorithms/inverse_mass/eigen_cholesky.hpp"
#include "algorithms/inverse_mass/openblas.hpp"
#include "algorithms/inverse_mass/sequential.hpp"
#include "algorithms/inverse_mass/sparse_ltdl.hpp"
#include "algorithms/riccati/array_mgs.hpp"
#include "algorithms/riccati/conventional.hpp"
#include "algorithms/riccati/ud.hpp"
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

using Variants = VariantList<Batch<EigenLLT>,           //
                             Batch<EigenLDLT>,          //
                             Batch<OpenBLAS>,           //
                             Batch<SparseLTDL>,         //
                             Sequential<Conventional>,  //
                             ClosedForm<Conventional>,  //
                             Sequential<ArrayMGS>,      //
                             Sequential<UD>>;

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
    const Outcome outcome = V::factor(model_, rm_, ws_);
    if (!outcome) return outcome;
    V::acceleration(model_, rm_, tau, ws_, a);
    return a.allFinite() ? Outcome{} : Outcome{Outcome::Status::not_finite};
  }

  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    set_position(model_, q, rm_);
    const Outcome outcome = V::factor(model_, rm_, ws_);
    if (!outcome) return outcome;
    V::inverse(model_, rm_, ws_, X);
    return X.allFinite() ? Outcome{} : Outcome{Outcome::Status::not_finite};
  }

  bool has_factors() const override { return filters; }

  Outcome factors(const VectorX<T>& q, VectorX<T>& D, MatrixX<T>& g) override {
    set_position(model_, q, rm_);
    const Outcome outcome = V::factor(model_, rm_, ws_);
    if constexpr (filters) {
      for (int k = 0; k < model_.nv(); ++k) {
        D[k] = ws_.factors.D[k];
        g.col(k) = ws_.factors.g[k];
      }
    }
    return outcome;
  }

 private:
  static constexpr bool filters = requires(typename V::template Workspace<T> ws) { ws.factors.D; };

  Model<T> model_;
  RandomModel<T> rm_;
  typename V::template Workspace<T> ws_;
};

template <class T>
std::vector<RegisteredVariant<T>> registered_variants() {
  std::vector<RegisteredVariant<T>> out;
  Variants::for_each([&]<class V>() {
    if constexpr (V::template supports<T>)
      out.push_back(
          {V::name(), V::equation, [](const Model<T>& model) -> std::unique_ptr<Solver<T>> {
             return std::make_unique<SolverOf<V, T>>(model);
           }});
  });
  return out;
}

}  // namespace kalmarm
