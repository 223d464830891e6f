// Numbers that decide how long an answer takes, not whether it can be used.
#pragma once

namespace kalmarm {

// The tolerances from which rungs are tried: few states of ordinary robots have an estimate in float below
// the share of the first, in double below that of the second. Parts of M^-1, which nothing refines, are left
// to two doubles where their bound is above the second.
inline constexpr double least_tolerance_of_float = 1e-3;
inline constexpr double least_tolerance_of_double = 1e-12;

// Largest M and M^-1 of rows of states that are worked out with a state in every lane; larger ones go
// state by state. With AVX-512 the block of lanes has 64 n^2 bytes, which are to lie in a cache of 1 MB.
// `bench_peers chain:96`, inverse and mass beside _batch, on a busy machine: rows take 0.9 to 1.4 times
// one state whose result stays in the cache; where it goes to an array of 1024 as theirs, 0.6 to 0.8.
inline constexpr int most_rows_in_lanes = 96;
// Of derivatives: `bench_batch chain:96 chain:97`, derivatives_batch, idle AMD EPYC: 52 us a state in
// lanes (float64) and 31 (float32), state by state 74 and 48, most of it writing to memory.
inline constexpr int most_derivatives_in_lanes = 96;

// Of the sweeps of a check: the margin of D of ordinary robots passes it, so that no bound is asked for, and errors
// above 1e-9 or so are told by double alone.
inline constexpr double tolerance_of_checks = 1e-10;

}  // namespace kalmarm
