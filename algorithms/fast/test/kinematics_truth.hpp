// Results of kalmarm/kinematics.hpp in 50 digits, rounded, from the definitions of mechanics
// (algorithms/test/dense_mechanics.hpp).
#pragma once

#include <array>
#include <vector>

#include "algorithms/fast/frames/kinematics_engine.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {

// In the order of KinematicResults. qdd stands in tau of the state. Frames are on the base, on a hinge or
// slide, or on the last DoF of another joint.
std::array<MatrixX<double>, kinematics> true_kinematics(const Model<double>& model,
                                                        const State<double>& state,
                                                        const std::vector<Frame>& frames,
                                                        Axes axes);

// dM/dt of a robot in motion, by differences whose error is some 1e-24.
MatrixX<double> mass_rate(const Model<double>& model, const State<double>& state);

}  // namespace kalmarm::test
