// THE list of variants: benchmarks, accuracy and tests all walk it. A new variant is one line here.
#pragma once

#include <functional>
#include <memory>
#include <optional>
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

// A variant in precision T, ready to be made for a model.
template <class T>
struct RegisteredVariant {
  std::string name;
  std::string equation;
  std::function<std::unique_ptr<Solver<T>>(const Model<T>&)> make;
};

// All variants that support T, in the list's order. Instantiated for float and double in
// registry.cpp.
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

extern template std::vector<RegisteredVariant<float>> registered_variants<float>();
extern template std::vector<RegisteredVariant<double>> registered_variants<double>();

}  // namespace kalmarm
