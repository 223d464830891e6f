// States from a JSON file: {"states": [{"qpos": [...], "qvel": [...], "tau": [...]}, ...]}, in
// MuJoCo's order and conventions; other keys are passed over, so that what `evaluate` wrote can be
// read again.
#pragma once

#include <string>
#include <vector>

#include "robots/scene/scene.hpp"

namespace kalmarm {

struct StateFile {
  std::vector<State> states;
  int normalized = 0;  // quaternions that did not have unit length and were normalised
};

// Throws InputError with file, state and value: wrong number of values, NaN, infinite, a quaternion
// of length zero.
StateFile read_states(const Scene& scene, const std::string& path);

}  // namespace kalmarm
