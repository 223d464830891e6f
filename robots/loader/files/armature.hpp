// What rotors and gears add to M where the file does not say it.
#pragma once

#include <mujoco/mujoco.h>

#include <map>
#include <string>

namespace kalmarm {

// Sets the armature of joints [kg m^2 or kg]; their actuators lose theirs. Throws InputError where
// there is no such joint or a value is negative or not finite.
void set_armature(mjSpec* spec, const std::map<std::string, double>& armature);

}  // namespace kalmarm
