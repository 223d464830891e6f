// Takes out of a scene's specification what M and the bias do not depend on (mujoco_model.hpp says
// what that is).
#pragma once

#include <mujoco/mujoco.h>

namespace kalmarm {

// Throws InputError where armature couples joints.
void strip(mjSpec* spec);

}  // namespace kalmarm
