// MuJoCo's own load of a robot's file, untouched by our loader: a reference in which its faults show.
#pragma once

#include <memory>
#include <string>

#include "robots/loader/mujoco_model.hpp"

namespace kalmarm {

struct Untouched {
  std::shared_ptr<const MujocoModel> model;  // null where MuJoCo refuses the file, or options
  std::string reason;                        // make another robot of it
};

// By MuJoCo alone, for comparison with what we read of the file with these options. Throws
// InputError where MuJoCo would hang or crash on what the file attaches.
Untouched load_untouched(const std::string& path, const LoadOptions& read);

}  // namespace kalmarm
