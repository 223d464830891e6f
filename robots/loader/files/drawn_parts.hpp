// What only a renderer, a collision checker or a middleware reads of a robot's file.
#pragma once

#include <string>
#include <vector>

#include "robots/loader/files/model_files.hpp"

namespace kalmarm {

// The text without such elements (without_elements of xml_tags.hpp):
//   URDF  visual, material, gazebo, transmission, collision of a link that has an inertial
//   MJCF  visual, material, texture, light, camera
// Nothing that weighs is left out: MuJoCo's reader gives a URDF's visual no mass, and a collision
// none where the link's inertia is given, unless the file has inertiafromgeom="true".
std::string without_drawn_parts(std::string text);

// The same of all files of a robot. What includes a file of which nothing is left does so no more:
// that reader refuses empty ones.
std::vector<ModelFile> without_drawn_parts(std::vector<ModelFile> files);

}  // namespace kalmarm
