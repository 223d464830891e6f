// What candidates are compared with: right to the last bits of float64, or it says by how much not.
//
//   a, M^-1 tau   WideRefined<FactoredBias<ArrayGivens>> in float64, whose residual is in long
//                 double: |d| / |x| of the last correction, e, tells its error (wide_refined.hpp),
//                   e_ref = e where e <= 8 u, else 100 e                                (1)
//                 Where corrections do not come down to the last bits, e is one random number of
//                 the error's size, and now and then far below it: of 15 000 choices for the
//                 laboratory's families (stress --advice) the error was up to 62 e.
//   M^-1          FactoredBias<ArrayGivens> in long double, rounded to float64. A refined column is
//                 right in its norm, which leaves its small entries less: they count as much, scaled
//                 by the diagonal. The same variant in float64 differs from it by its own error, E;
//                 both errors are a number times u, and so
//                   e_ref = u + 10 E u_l / u                                            (2)
//                 with u_l of long double.
#pragma once

#include <memory>

#include "algorithms/solver.hpp"

namespace kalmarm {

std::unique_ptr<Solver<double>> make_reference(const Model<double>& model);

}  // namespace kalmarm
