// Constraints in JSON, for what a robot's file cannot say, as the loops of a URDF:
//   {"constraints": [{"name": "pin", "first": "rod", "second": {"frame": "rocker", "translation": [0.3, 0, 0]}}, ...]}
// Fields are those of Constraint (kalmarm/constraint.hpp), and need not be there but for the name:
//   kind                       "point", which it is unless said otherwise, "pose" or "coupling"
//   first, second              a frame's name, "world" unless said otherwise; or that with "translation" [m] and "rotation"
//                              (w, x, y, z) in the frame's axes
//   joints, other              J1 and J2: numbers by the names of joints, where "left_*" is all that match and "ball" all its
//                              DoF; or a list of nv
//   polynomial                 c, up to five numbers
//   compliance, impedance      two numbers; least, most, width, midpoint, power
//   turning, reference, stiffness, damping, velocity_terms
#pragma once

#include <string>
#include <vector>

#include "kalmarm/load.hpp"

namespace kalmarm {

// Throws InputError with the file and the constraint.
std::vector<Constraint> read_constraints(const std::string& path, const RobotModel& model,
                                         const std::vector<NamedFrame>& frames);

}  // namespace kalmarm
