// A state that a file names.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

struct Keyframe {
  VectorX<double> q, qd;  // nq, nv; empty: as the model starts, at rest
};

// As the file has it; its activations are ignored, its controls are in actuators.hpp. Throws
// InputError where there is none of this name, with those that there are. Ask it before strip().
Keyframe keyframe_called(mjSpec* spec, const std::string& name);

// Of the model, whole and with unit quaternions. Throws InputError where it is not the model's.
Keyframe completed(Keyframe given, const mjModel* model);

}  // namespace kalmarm
