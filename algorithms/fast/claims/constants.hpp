// Every number on which a promise of the library rests and that is chosen, not derived: what it is for, and
// what it was measured or chosen by. At most six (scripts/count_constants); what is promised itself stands in
// kalmarm/tolerance.hpp, numbers for speed alone in tuning.hpp.
#pragma once

namespace kalmarm {

// How far roundings of forces and motions add up, in units of u, in what is accepted and in Outcome::error: a
// number is rounded about ten times. With 1 a search found errors four times the bound; 3 is the
// least whole number with which `error` is at least half the error on families (test_error_estimate.cpp).
inline constexpr double rounding_constant = 4;

// The same of P, in the order of matrices. A proof needs about 40, if all roundings had one sign; with 8 the
// bound was never below the error of any sweep against multi-precision (test_rounding_bound.cpp).
inline constexpr double rounding_constant_of_P = 8;

// The error of a D, or of a pivot of rows that couple joints, in units of u, that counts where none is
// measured. In float32 solves climb where sqrt(T E) / |x| of (8') of force_noise.hpp is 33 or more: 60 random
// torques at chain:1000 reach 250, the nine robots 25. Coupled rows imposed twice leave at most 4
// (test_coupled_rows.cpp).
inline constexpr double roundings_of_D = 512;

// Of an answer that a tolerance allows, the share that its estimate, and the error of any D, may be where a
// rung answers: the rest is left for what the sums do not count, and for errors of several D. With a tenth a
// search of 1e5 float rows found 0.201 of the tolerance, where a fifth is to be left; g1 and chains would
// climb below a twentieth.
inline constexpr double accepted_share = 1.0 / 12;

// Beside gravity a smaller |a| is nothing.
inline constexpr double least_beside_gravity = 0.01;

// The error of a D up to which its bound, of first order, stands: beyond, factors refine nothing, and
// derivatives warn.
inline constexpr double largest_error_of_D = 0.01;

}  // namespace kalmarm
