// The variants that take contacts (contacts/contact_row.hpp): errors and times walk this list.
#pragma once

#include <span>
#include <type_traits>

#include "algorithms/study/contacts/conjugate_gradient.hpp"
#include "algorithms/study/inverse_mass/batch.hpp"
#include "algorithms/study/inverse_mass/eigen_cholesky.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/riccati/conventional.hpp"
#include "algorithms/study/riccati/rows_beside.hpp"
#include "algorithms/study/riccati/ud.hpp"

namespace kalmarm {

// f.template operator()<V>() for every variant V.
template <class F>
void for_each_contact_variant(F&& f) {
  const auto all = [&]<class... Vs>() { (f.template operator()<Vs>(), ...); };
  all.template operator()<Batch<EigenLLT>,               //
                          Batch<EigenLDLT>,              //
                          Sequential<Conventional>,      //
                          Sequential<Joseph>,            //
                          Sequential<RowsBeside>,        //
                          Sequential<UD>,                //
                          Sequential<Potter>,            //
                          Sequential<ArrayHouseholder>,  //
                          Sequential<ArrayMGS>,          //
                          Sequential<ArrayGivens>,       //
                          ConjugateGradient<DiagonalOfM>,
                          ConjugateGradient<InverseOfM<Sequential<Conventional>>>>();
}

// x = H^-1 b from the placements on.
template <class V, class T>
Outcome solve_standing(const Model<T>& model, const LinkKinematics<T>& kin,
                       std::span<const ContactRow<T>> contacts, const VectorX<T>& b,
                       typename V::template Workspace<T>& ws, VectorX<T>& x) {
  const Outcome outcome = V::factor(model, kin, contacts, ws);
  if (!outcome) return outcome;
  if constexpr (std::is_void_v<decltype(V::solve(model, kin, b, ws, x))>)
    V::solve(model, kin, b, ws, x);
  else
    return V::solve(model, kin, b, ws, x);
  return outcome;
}

}  // namespace kalmarm
