// Robots from models that MuJoCo has compiled already.
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "kalmarm/load.hpp"

namespace kalmarm {

// The robot of a compiled model as it is now, by the rules of load_robot. controls: MuJoCo's ctrl (nu). Of the options
// those count that say what who asks takes.
// Throws InputError, in one line with the name.
LoadedRobot robot_of(const mjModel* model, const std::string& name,
                     const std::vector<double>& controls, const LoadOptions& options);

}  // namespace kalmarm
