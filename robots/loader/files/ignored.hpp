// What a file holds that no solver here sees: its motion is not that of M and the bias alone.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

#include "kalmarm/load.hpp"
#include "robots/loader/parts.hpp"

namespace kalmarm {

// The joints, by name, that couplings of joints (a URDF's mimic) name and the file has not; "" where
// all are there.
std::string note_of_loose_couplings(mjSpec* spec);

// "2 connect constraints, 12 actuators, damping of 7 joints": constraints that are active,
// actuators, tendons and flexes, and of joints and bodies the forces that MuJoCo adds to the bias.
// Empty where there is none. Contacts and joint limits are not named: every file has them.
// Couplings of joints may be imposed, damping and friction added, and steps taken with springs and
// actuators, by who asks, as the options say.
// Of a specification ask it before strip().
std::string ignored_parts(const MovingParts& parts, const LoadOptions& options);

}  // namespace kalmarm
