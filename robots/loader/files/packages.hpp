// Meshes that a URDF names by ROS package, package://PACKAGE/PATH.
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

namespace kalmarm {

// Sets the file of every such mesh to the first that exists of
//   DIR/PACKAGE/PATH, DIR/PATH where DIR is called PACKAGE    DIR of package_path, then of
//                                                             ROS_PACKAGE_PATH
//   PREFIX/share/PACKAGE/PATH                                 PREFIX of AMENT_PREFIX_PATH
//   DIR/PACKAGE/PATH                                          DIR above the robot's file
// and leaves the others, which matter only where an inertia needs them. file://PATH is PATH. Throws
// InputError where a DIR of package_path is no folder.
void find_packages(mjSpec* spec, const std::string& robot_file,
                   const std::vector<std::string>& package_path);

// "a:b" are a and b.
std::vector<std::string> folders_of(const std::string& path);

}  // namespace kalmarm
