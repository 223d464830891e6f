// What only a renderer or a middleware reads of a robot's file.
#pragma once

#include <string>
#include <vector>

#include "robots/loader/files/model_files.hpp"

namespace kalmarm {

// The text without such elements (without_elements of xml_tags.hpp):
//   URDF  visual, material, gazebo, transmission
//   MJCF  visual, material, texture, light, camera
// Nothing that weighs is left out: MuJoCo's reader gives a URDF's visual no mass.
std::string without_drawn_parts(std::string text);

// The same of all files of a robot. What includes a file of which nothing is left does so no more:
// that reader refuses empty ones.
std::vector<ModelFile> without_drawn_parts(std::vector<ModelFile> files);

}  // namespace kalmarm
