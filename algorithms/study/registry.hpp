// THE list of variants: benchmarks, accuracy and tests all walk it. A new variant is one line here.
// To use variants include solver.hpp, which is light; to compile them for a scalar, this.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/inverse_mass/batch.hpp"
#include "algorithms/study/inverse_mass/closed_form.hpp"
#include "algorithms/study/inverse_mass/eigen_cholesky.hpp"
#include "algorithms/study/inverse_mass/factored_bias.hpp"
#ifndef KALMARM_WITHOUT_OPENBLAS
#include "algorithms/study/inverse_mass/openblas.hpp"
#endif
#include "algorithms/study/inverse_mass/refinement/mixed_precision.hpp"
#include "algorithms/study/inverse_mass/refinement/refined.hpp"
#include "algorithms/study/inverse_mass/refinement/wide_refined.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/inverse_mass/sparse_ltdl.hpp"
#include "algorithms/study/inverse_mass/stacked_qr.hpp"
#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/riccati/conventional.hpp"
#include "algorithms/study/riccati/in_world_frame.hpp"
#include "algorithms/study/riccati/ud.hpp"
#include "algorithms/study/scan/divide_and_conquer.hpp"
#include "algorithms/study/scan/scan.hpp"
#include "algorithms/study/scan/square_root_element.hpp"
#include "algorithms/study/solver_of.hpp"

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
using Contenders = VariantList<Batch<EigenLLT>,   //
                               Batch<EigenLDLT>,  //
#ifndef KALMARM_WITHOUT_OPENBLAS
                               Batch<OpenBLAS>,  //
#endif
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
                             Sequential<WorldOrigin<UD>>,                //
                             Scan<scan::Conventional>,                   //
                             Scan<scan::SquareRoot>,                     //
                             DivideAndConquer<false>,                    //
                             DivideAndConquer<true>>;

// A trait of V or of what it is made of.
#define KALMARM_TRAIT(trait)                            \
  template <class V>                                    \
  consteval bool trait##_of() {                         \
    if constexpr (requires { V::trait; })               \
      return V::trait;                                  \
    else if constexpr (requires { typename V::Inner; }) \
      return trait##_of<typename V::Inner>();           \
    else                                                \
      return false;                                     \
  }
KALMARM_TRAIT(dense)
KALMARM_TRAIT(in_world_frame)
KALMARM_TRAIT(mixed_precision)
#undef KALMARM_TRAIT

template <class V>
VariantTraits traits_of(bool contender) {
  return {.kind = V::kind,
          .contender = contender,
          .in_world_frame = in_world_frame_of<V>(),
          .dense = dense_of<V>(),
          .mixed_precision = mixed_precision_of<V>(),
          .citation = V::citation};
}

// M by composite inertias, which every batch variant starts from.
template <class T>
class CompositeSolver final : public Solver<T> {
 public:
  explicit CompositeSolver(const Model<T>& model)
      : model_(model), kin_(model_), composite_(model_) {}

  void mass(const VectorX<T>& q, MatrixX<T>& M) override {
    set_position(model_, q, kin_);
    mass_matrix(model_, kin_, composite_, Eigen::Ref<MatrixX<T>>(M));
  }

  // It factors nothing.
  Outcome acceleration(const VectorX<T>&, const VectorX<T>&, const VectorX<T>&,
                       VectorX<T>&) override {
    return nothing;
  }
  Outcome factor(const VectorX<T>&) override { return nothing; }
  void solve(const VectorX<T>&, VectorX<T>& x) override {
    x.setConstant(T(std::numeric_limits<double>::quiet_NaN()));
  }
  Outcome inverse(const VectorX<T>&, MatrixX<T>&) override { return nothing; }

 private:
  static constexpr Outcome nothing{.status = Outcome::Status::not_finite};

  Model<T> model_;
  LinkKinematics<T> kin_;
  CompositeInertia<T> composite_;
};

template <class T>
std::vector<RegisteredVariant<T>> registered_variants(Want want) {
  std::vector<RegisteredVariant<T>> out;
  const auto add_solver = [&]<class S>(const std::string& name, const std::string& equation,
                                       const VariantTraits& traits) {
    if (traits.gives(want))
      out.push_back({name, equation, traits, [](const Model<T>& model) {
                       return std::unique_ptr<Solver<T>>(std::make_unique<S>(model));
                     }});
  };
  bool contender = true;
  const auto add = [&]<class V>() {
    if constexpr (V::template supports<T>)
      add_solver.template operator()<SolverOf<V, T>>(V::name(), V::equation,
                                                     traits_of<V>(contender));
    if constexpr (requires(const Model<T>& model) { V::applies(model); })
      if (!out.empty() && out.back().name == V::name()) out.back().takes = V::template applies<T>;
  };
  add_solver.template operator()<CompositeSolver<T>>(
      "CRBA", "M(m,k) = H(m) phi(m,k) r-(k) H(k)', (5.1)",
      {.kind = VariantKind::composite,
       .wants = {Want::mass},
       .citation = "Walker and Orin 1982, composite rigid bodies"});
  Contenders::for_each(add);
  if constexpr (std::is_floating_point_v<T>) {
    std::vector<RegisteredVariant<T>> ladder = ladder_variants<T>();
    if constexpr (std::is_same_v<T, double>) ladder.push_back(two_doubles_variant());
    const auto add_ladder = [&] {
      for (const RegisteredVariant<T>& variant : ladder)
        if (variant.traits.contender == contender && variant.traits.gives(want))
          out.push_back(variant);
    };
    add_ladder();
    if (RegisteredVariant<T> variant = square_root_variant<T>(); variant.traits.gives(want))
      out.push_back(variant);
    contender = false;
    add_ladder();
    Exhibits::for_each(add);
  }
  return out;
}

}  // namespace kalmarm
