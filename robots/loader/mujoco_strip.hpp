// Takes out of a scene's specification what neither M, the bias nor an implicit step depend on
// (mujoco_model.hpp says what that is).
#pragma once

#include <mujoco/mujoco.h>

namespace kalmarm {

enum class Sites { stripped, kept };

// True where MuJoCo's compiler will take the body's inertia from its geoms.
bool inertia_from_geoms(const mjSpec* spec, const mjsBody* body);

// Throws InputError where armature couples joints; of fixed tendons it may where whoever asks takes steps
// with their rows.
void strip(mjSpec* spec, Sites sites = Sites::stripped, bool takes_steps = false);

}  // namespace kalmarm
