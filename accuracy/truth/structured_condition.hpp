// How much of the answer do the parameters decide? Every parameter p of a model, every entry of q,
// qd, tau and gravity moves to p (1 + s delta) with a random sign s = +-1; what is zero stays zero.
// With da the response of a = M^-1 (tau - bias) to first order,
//   kS = sqrt(mean over draws of |da|^2) / (|a| delta)
// in the 2-norm and in the norm |a|^2 = a'M a. An algorithm whose error is some u kS is as good as
// one that errs by u in each parameter alone, however large kappa(M) is.
//
// ID(a) = M a + bias is the inverse dynamics, ' marks what was moved. Since M a + bias = tau,
//   M da = r,   r = ID(a) - ID'(a) + tau' - tau                                            (1)
// to first order, where the true a makes no difference to the derivative: a draw costs one inverse
// dynamics and one product M^-1 r, for all tasks of a state one moved model. In the second norm
//   da'M da = da'r,   M a = ID(a) at rest without gravity                                  (2)
//
// What (1) leaves out is delta kappa(M) |da| at most, and the rounding of r becomes
// 10^-digits kappa(M) / (kS delta) of da. The truth was carried with as many digits as make
// kappa(M) 10^-digits at most 1e-25; twice the digits here, and delta = 10^-digits, make both
// negligible.
//
// With 9 digits all is worked out in long double. That is for a kS of which the decade is asked
// (acceleration_truth.hpp): kS delta << 1 is all that is known of the error then. Of 400 wild
// mechanisms, whose kS is up to 4e6, none is off by 3 per cent.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "accuracy/truth/task.hpp"
#include "algorithms/model/model.hpp"

namespace kalmarm {

// M^-1 applied to a vector.
using Solve = std::function<VectorX<Real>(const VectorX<Real>&)>;

// Of every task, whose tau and true a stand in its response. solve: true for q to a few digits.
template <class T>
std::vector<StructuredCondition> structured_condition(const Model<T>& model, const VectorX<T>& q,
                                                      const std::vector<Task<T>>& tasks,
                                                      const std::vector<Response<T>>& responses,
                                                      const Solve& solve, unsigned digits,
                                                      int draws, std::uint64_t seed = 1);

}  // namespace kalmarm
