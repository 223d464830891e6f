// A robot as the text of an MJCF file.
#pragma once

#include <string>

#include "algorithms/model/model.hpp"

namespace kalmarm {

// A joint as a file has it: "hinge", "slide", "ball" or "free", of one or several links of the model.
struct FileJoint {
  const char* type;
  int dofs;
};

// joint: the one of the first DoF.
FileJoint file_joint(const Joint<double>& joint);

// Read again by load_scene, the text gives the same model to the last bit where the model is as
// the loader makes one (mujoco_model.hpp): DoF numbered depth first, all but the last link of a
// ball or free joint without inertia, a free joint on the world at its origin, quaternions of unit
// length. A body is named like its joint. Frames of MJCF have their origin on the joint and their z axis along it.
std::string to_mjcf(const Model<double>& model, const std::string& name);

}  // namespace kalmarm
