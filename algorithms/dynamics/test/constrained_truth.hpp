// Constrained accelerations in 50 digits, behind doubles: from e of constraints alone (kalmarm/constraint.hpp), of which J and
// dJ/dt qd are differences, and the equations of Newton and Euler.
#pragma once

#include <vector>

#include "algorithms/fast/test/truth.hpp"
#include "algorithms/test/models.hpp"
#include "kalmarm/constrained_dynamics.hpp"

namespace kalmarm::test {

struct ConstrainedTruth {
  MatrixX<double> M;
  VectorX<double> e, rate, a, forces;
};

// Of constraints without an impedance, whose rows are independent; push: from outside.
ConstrainedTruth constrained_truth(const Model<double>& model, const State<double>& state,
                                   const std::vector<Constraint>& constraints,
                                   const Push& push = {});

}  // namespace kalmarm::test
