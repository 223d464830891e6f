// What is in a scene's file, and how much of it M and the bias need.
#pragma once

#include <string>
#include <vector>

#include "robots/scene/scene.hpp"

namespace kalmarm {

struct Inventory {
  struct Element {
    std::string kind;  // "geom", "mesh" ...
    int given = 0;     // in the file
    int kept = 0;      // of which M depends on so many: an inertia or an armature comes from it
  };

  std::vector<Element> elements;  // of which there are any; of a family none
  int bodies = 0;                 // besides the world
  int moving = 0;                 // that have joints
  int welded = 0;                 // whose inertia goes to the link they are welded to
  int fixed = 0;                  // that cannot move: their inertia does not count
};

// Throws InputError where the scene's file cannot be read again.
Inventory inventory_of(const Scene& scene);

}  // namespace kalmarm
