// The base of a legged robot. URDF welds the root link to the world, and so does MJCF a body
// without joints.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

namespace kalmarm {

// Gives a root, which is a body that stands in the world, the free joint "floating_base": the one
// of this name, or with "" the only one that carries joints and has none itself. Throws InputError
// where that is not one, or where it has a joint.
void free_root(mjSpec* spec, const std::string& link);

// "4 limbs hang on 'trunk', which is welded to the world: option floating frees it", of a root that
// carries three limbs or more where nothing in the file has a free joint; else empty.
std::string note_of_welded_base(mjSpec* spec);

}  // namespace kalmarm
