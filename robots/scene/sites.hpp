// Frames that a scene's file names: where motions are asked for.
#pragma once

#include <string>
#include <vector>

#include "algorithms/model/site.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

struct NamedSite {
  std::string name;
  Site<double> site;
};

// The sites of the scene's file, then its bodies (the frame in which their children stand); of a
// family its links, by the names of their joints. Throws InputError where the file cannot be read
// again.
std::vector<NamedSite> sites_of(const Scene& scene);

}  // namespace kalmarm
