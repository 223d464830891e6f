// What a file holds that no solver here sees: its motion is not that of M and the bias alone.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

namespace kalmarm {

// "2 connect constraints, 12 actuators, damping of 7 joints": constraints that are active,
// actuators, tendons and flexes, and of joints and bodies the forces that MuJoCo adds to the bias.
// Empty where there is none. Contacts and joint limits are not named: every file has them.
// Couplings of joints may be imposed by who asks. Ask it before strip().
std::string ignored_parts(mjSpec* spec, bool couplings_are_imposed);

}  // namespace kalmarm
