// Reading a file as LoadOptions say: before anything is stripped or compiled, so that whoever asks
// about the file sees the same robot.
#pragma once

#include <string>
#include <vector>

#include "kalmarm/load.hpp"
#include "robots/loader/actuators.hpp"
#include "robots/loader/files/keyframe.hpp"
#include "robots/loader/mujoco_spec.hpp"

namespace kalmarm {

struct ReadFile {
  SpecPtr spec;
  std::vector<std::string> notes;  // what was ignored, and what the options changed
  Keyframe key;                    // as the file has it; empty where none is asked for
  std::vector<Control> controls;   // of the actuators that have terms
};

// From an MJCF or URDF file. Throws InputError with the file.
ReadFile read_file(const std::string& path, const LoadOptions& options);

}  // namespace kalmarm
