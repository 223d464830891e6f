// MuJoCo's own load of a robot's file, untouched by our loader: a reference in which its faults show.
#pragma once

#include <memory>
#include <string>

#include "robots/scene/scene.hpp"

namespace kalmarm {

struct Untouched {
  std::shared_ptr<const MujocoModel> model;  // null where MuJoCo refuses the file, or options
  std::string reason;                        // make another robot of it
};

// By MuJoCo alone, for comparison with what we read of the file with these options. Throws
// InputError where MuJoCo would hang or crash on what the file attaches.
Untouched load_untouched(const std::string& path, const LoadOptions& read);

// MuJoCo's model of a scene: of its file, untouched, or, for a reason, of what we read of it.
struct Reference {
  std::shared_ptr<const MujocoModel> model;
  std::string why_touched;  // "" where it is of the file, untouched

  std::string words() const {
    return why_touched.empty() ? "the file, untouched" : "what we read, since " + why_touched;
  }
};

// Throws InputError where the file has other joints than we read of it.
Reference reference_of(const Scene& scene);

// Likewise for MujocoStep: without what has no terms (robots/README.md), and at the scene's controls.
Reference step_reference_of(const Scene& scene);

}  // namespace kalmarm
