// Every number of the fast path's tests that is chosen, not derived: what it is for, and what it was
// measured or chosen by. No other header has one.
#pragma once

#include <type_traits>

namespace kalmarm {

// How far roundings add up, in units of u. A proof needs about 40, if all had one sign; with 8 the
// bound was never below the error of any sweep against multi-precision (test_rounding_bound.cpp).
inline constexpr double rounding_constant = 8;

// The same of sums of traces, which are up to six times the largest eigenvalue that counts.
inline constexpr double rounding_constant_of_traces = rounding_constant / 3;

// The same of forces and motions in what is accepted of accelerations: a number is rounded about ten
// times. With 1 a search found errors four times the bound.
inline constexpr double rounding_constant_of_a = 4;

// The error of D, in units of u, that a solve counts before it is measured: in float32 what makes
// sqrt(T E) / |x| of (8') 33 or more climbs. 60 random torques at chain:1000 reach 250,
// the nine robots 25.
inline constexpr double rounding_constant_of_unmeasured_D = 512;

// The same in Outcome::error: the least whole number with which it is at least half the error on all
// families (test_error_estimate.cpp).
inline constexpr double rounding_constant_of_error = 3;

// Of what a closer sum may add to the promise, the share that is not looked at more closely.
inline constexpr double little_share = 0.01;

// Beside gravity a smaller |a| is nothing.
inline constexpr double least_beside_gravity = 0.01;

// A weight for what a link cannot absorb: beyond any that a body has, and its square in range.
inline constexpr double no_body = 1e30;

// Refinement (certified/refine.hpp).
//   The first step leaves at most this many times its own relative size: a rule of experience.
inline constexpr double first_contraction = 100;
//   What a later step may leave of the one before.
inline constexpr double worst_contraction = 0.3;
//   The first correction over |x|, or over gravity_share of gravity: pairs keep no more digits of what
//   cancels within a link than double has, which a search found at 1e-8.
inline constexpr double farthest_start = 1e-9;
inline constexpr double gravity_share = 0.1;
//   What rounding of the residual may do to answers in float64, by a bound, in units of u.
inline constexpr double enough_of_residuals = 8;
//   Beyond, the share of that bound that is claimed: the truth was at most a third of the bound.
inline constexpr double claimed_share_of_residuals = 0.25;
//   How far constants move a through gravity, in units of u2, by (2) of certified_acceleration.hpp: a search
//   found 6 along a slide that is level to a bit, of which a third is told. Twice as much would tell more
//   than 400 u where torques hold a robot (test_certified.cpp).
inline constexpr double roundings_of_constants = 2;
//   The unit roundoff of pairs: two more bits are lost than two doubles have.
inline constexpr double roundoff_of_pairs = 0x1p-104;

// Errors of parts of M^-1 that are not refined, in units of u sqrt(nv); beyond, the next precision
// answers. Families of the tests are below (test_certified.cpp).
inline constexpr double enough_of_parts = 64;
// The least that is told of them, in units of u: entries are sums of rounded products, and a search
// found one 12 u wrong where eight probes had shown 2 u.
inline constexpr double least_error_of_parts = 4;
// Of factors by which solves are refined.
inline constexpr double enough_of_factors = 1e-3;

// Largest M and M^-1 of rows of states that are worked out with a state in every lane; larger ones go
// state by state. With AVX-512 the block of lanes has 64 n^2 bytes, which are to lie in a cache of 1 MB.
// `bench_peers chain:96`, inverse and mass beside _batch, on a busy machine: rows take 0.9 to 1.4 times
// one state whose result stays in the cache; where it goes to an array of 1024 as theirs, 0.6 to 0.8.
inline constexpr int most_rows_in_lanes = 96;
// Of derivatives: `bench_batch chain:96 chain:97`, derivatives_batch, idle AMD EPYC: 52 us a state in
// lanes (float64) and 31 (float32), state by state 74 and 48, most of it writing to memory.
inline constexpr int most_derivatives_in_lanes = 96;

// Of rows that couple joints (dynamics/coupled_rows.hpp): how many u of a diagonal entry of C + G its
// pivot may be by rounding alone. Rows imposed twice leave at most 4 (test_coupled_rows.cpp).
inline constexpr double roundings_of_rows = 64;

}  // namespace kalmarm
