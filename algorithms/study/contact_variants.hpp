// The variants that take contacts (contacts/contact_row.hpp): errors and times walk this list.
#pragma once

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
                          Sequential<ArrayGivens>>();
}

}  // namespace kalmarm
