// What a plan costs a call, by the fast path within a tolerance.
#pragma once

#include "algorithms/dynamics/plan.hpp"

namespace kalmarm {

// What else decides the flops of M, M^-1 and derivatives: long chains go by blocks whose size is that of
// registers, but not the states of many rows, up to most_rows_in_lanes or most_derivatives_in_lanes DoF.
struct CallKind {
  bool rows = false;  // one call for many states
};

// Additions, multiplications and divisions of one call for one kind of answer, a state, in either
// precision: one state in float is answered in double. Sines and cosines are not counted. Each is counted by running it on one state, as many times as there are
// columns. Only what goes by blocks and chosen blocks of M^-1 are as their headers
// say, and so is M^-1 tau, one tau.
double flops(const Plan& plan, Want want, double tolerance = default_tolerance<double>,
             CallKind call = {});

// The same of a whole robot, by the rules that can be followed within the tolerance; empty: the default.
double flops_of(const Model<double>& model, Want want, std::optional<double> tolerance,
                CallKind call = {});

}  // namespace kalmarm
