// A robot's file with other inertial parameters, as MJCF.
//
// A link (algorithms/model/model.hpp) may be several bodies of the file that are welded together.
// Its whole inertia goes to the body that carries the joint; the others become massless: what a
// fit has learnt is their sum, and how it is shared would be invented. An armature goes to the
// joint, and its actuators lose theirs.
// Everything else of the file is kept where MuJoCo can compile all of it; the folders of meshes and
// textures become absolute. Where it cannot (a mesh is missing), the stripped robot is saved
// (mujoco_model.hpp).
#pragma once

#include <map>
#include <string>

#include "algorithms/spatial/inertia.hpp"
#include "kalmarm/load.hpp"

namespace kalmarm {

// What a fit has changed, by DoF k of the lowered model; what is not named stays.
struct FittedParameters {
  std::map<int, SpatialInertia<double>> inertia = {};  // of link k, about its origin in its axes
  std::map<int, double> armature = {};                 // r(k) [kg m^2 or kg]
  std::map<int, double> viscous = {};                  // damping [N m s or N s/m]
  std::map<int, double> coulomb = {};                  // frictionloss [N m or N]
};

// The MJCF text of the file as it was read, its numbers with 17 digits; `note` becomes a comment at
// its beginning. The text has been read again, and gives the same kinematics, inertias and armatures
// to 1e-9. Throws
// InputError with file and joint: a pseudo-inertia that is not positive semidefinite, a link
// without a body (between the DoF of a joint of several), the inertia of a free body that MuJoCo
// aligns with it, a negative armature or friction, different ones for the DoF of one joint, what
// MuJoCo cannot hold (a rod at the end of a branch).
std::string save_fitted(const std::string& robot_file, const FittedParameters& fitted,
                        const std::string& note, const LoadOptions& read = {});

}  // namespace kalmarm
