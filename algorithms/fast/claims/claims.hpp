// What the calls of the fast path promise, in one place; docs/errors.md says it to users. `silent`:
// an Outcome without a warning (Outcome::warns) that is no refusal.
//
//   call            rung       promised where silent                        norm
//   acceleration    first two  |da| <= tolerance |a|                        Euclid's    (1)
//                              error ~ |da|_M / |a|_M                       energy      (2)
//                   refined    error ~ |da| / |a|                           Euclid's    (3)
//   M^-1, selected  first two  every D within a twelfth of tolerance        Loewner's   (4)
//   M^-1            first two  rounding of a column's own numbers
//                              |dX_ij| <= tolerance sqrt(X_ii X_jj)         entries     (6)
//                   refined    |dX_ij| <= error sqrt(X_ii X_jj)             entries     (5)
//   diagonal        refined    |dx_i| <= error x_i                          entries     (5)
//   log det M       refined    |dL| <= error max(1, |L|)                    number      (5)
//   solve           first two  |dx| <= tolerance |x|, columns               Euclid's    (1)
//                   refined    |dx| <= error |x|, columns alone             Euclid's    (5)
//   derivatives     float64    (4); no error is estimated
//
// (1) by (8), (8') and (9) of force_noise.hpp, a beside a hundredth of gravity where |a| is less;
// (2) by (10) there; (3) by (2) of refine.hpp, beside u (|gravity| + |qd|^2) where |a| is less: where
// forces cancel to their last digits there is none left to be right; (4) by rounding_test.hpp and rounding_bound.hpp: in
// the order of positive semidefinite matrices M of the factors is within 1 +- e of M;
// (5) by certified_factors.hpp, of solves by (1) and (2) of refine.hpp; (6) by (11) of force_noise.hpp.
#pragma once

#include <algorithm>

#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/fast/claims/tuning.hpp"
#include "kalmarm/tolerance.hpp"

namespace kalmarm {

// Of a rung's own answers.
constexpr double accepted_error(double tolerance) { return accepted_share * tolerance; }

// Of refined answers, whose last rounding alone is most of last_bits' share.
constexpr double accepted_error_refined(double tolerance) {
  return std::max(accepted_error(tolerance), last_bits);
}
// Of M^-1 and its parts, which nothing refines.
constexpr double accepted_error_of_parts(double tolerance) {
  return std::max(accepted_error(tolerance), least_tolerance_of_double);
}

// Of what two doubles answer, the error beyond which it warns.
inline constexpr double enough_in_two_doubles = default_tolerance<double>;

}  // namespace kalmarm
