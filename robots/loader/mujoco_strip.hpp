// Takes out of a scene's specification what neither M, the bias nor an implicit step depend on
// (mujoco_model.hpp says what that is).
#pragma once

#include <mujoco/mujoco.h>

#include "kalmarm/load.hpp"

namespace kalmarm {

// Sites, and bodies that MuJoCo fuses with others where a file has them fused, as a URDF does.
enum class Frames { stripped, kept };

// True where MuJoCo's compiler will take the body's inertia from its geoms. Those that have no mass or
// are outside of inertiagrouprange do not count.
bool inertia_from_geoms(const mjSpec* spec, mjsBody* body);

// Takes out all geoms and meshes but those that an inertia comes from, and the inertias of bodies that
// cannot move but the mass that counts in settotalmass, if it is kept.
void strip_inertias(mjSpec* spec, bool keeps_static_mass);

// Throws InputError where armature couples joints; of fixed tendons it may where whoever asks takes steps
// with their rows.
void strip(mjSpec* spec, Frames frames = Frames::stripped, const LoadOptions& options = {});

}  // namespace kalmarm
