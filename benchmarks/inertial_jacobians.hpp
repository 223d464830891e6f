// Benchmarks of the Jacobian of one sample's residual over the inertial parameters of all bodies,
// ten log-Cholesky coordinates x each (inertial_parameters.hpp):
//
//   jacobian_inverse_dynamics   tau - ID(q, q', q'')                           nv rows
//   jacobian_forward_dynamics   q'' - M^-1 (tau - bias)                        nv rows
//   jacobian_innovations        D^-1/2 (I - L) (tau - ID)                      nv rows
//   jacobian_mass_matrix        minus the lower triangle of M                  nv (nv + 1) / 2 rows
// by the factored derivatives (Factored), by Ceres' dual numbers (AutoDiff), and by Ceres' forward
// and central differences (NumericDiff, NumericDiffCentral) with its default steps. The last three
// run the whole residual, through the same templates.
#pragma once

#include <memory>

#include "benchmarks/case.hpp"

namespace kalmarm {

// Every Jacobian is verified before it is timed, against dual numbers in a wider precision: the
// counter `error` is the largest relative error, in the norm of Frobenius, over the states checked.
void add_inertial_jacobians(std::shared_ptr<const Case> c);

}  // namespace kalmarm
