// What the calls of the fast path promise, in one place; docs/errors.md says it to users. `silent`:
// an Outcome without a warning (Outcome::warns) that is no refusal.
//
//   call            rung       promised where silent                        norm
//   acceleration    first two  |da| <= tolerance |a|                        Euclid's    (1)
//                              error ~ |da|_M / |a|_M                       energy      (2)
//                   refined    error ~ |da| / |a|                           Euclid's    (3)
//   M^-1, selected  first two  every D within a fifth of tolerance          Loewner's   (4)
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
// (2) by (10) there; (3) by (3) of refine.hpp, beside u (|gravity| + |qd|^2) where |a| is less: where
// forces cancel to their last digits there is none left to be right; (4) by rounding_test.hpp and rounding_bound.hpp: in
// the order of positive semidefinite matrices M of the factors is within 1 +- e of M;
// (5) by (3) and (4) of probe.hpp, which are measured on random torques; (6) by (11) of force_noise.hpp.
#pragma once

#include <type_traits>

#include "kalmarm/tolerance.hpp"

namespace kalmarm {

// Of an answer that a tolerance allows, the share that its estimate may be where a rung answers: the rest is
// left for what the sums do not count. Searches find at most 0.4 of what is accepted.
inline constexpr double accepted_share = 0.1;

// The same of a D, over what is accepted of an answer. With less the inboard links of chains of 127 climb
// from float in every state.
inline constexpr double of_D_over_of_a = 2;

constexpr double accepted_error_of_a(double tolerance) { return accepted_share * tolerance; }
constexpr double error_of_D_let_pass(double tolerance) {
  return of_D_over_of_a * accepted_error_of_a(tolerance);
}

// Refined answers: a bound of the last correction's error over |x|; and of what two doubles answer, the error
// beyond which it warns.
inline constexpr double trusted_error = accepted_error_of_a(default_tolerance<double>);
inline constexpr double enough_in_two_doubles = default_tolerance<double>;

// The tolerances from which rungs are tried: few states of ordinary robots have an estimate in float below
// the share of the first, in double below that of the second.
inline constexpr double least_tolerance_of_float = 1e-3;
inline constexpr double least_tolerance_of_double = 1e-12;

// Of D, where the factors refine or measure an answer: they have to be right to a digit.
inline constexpr double error_of_D_to_refine = 1e-2;

}  // namespace kalmarm
