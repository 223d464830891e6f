// A robot as the text of a URDF file, for engines that read no MJCF.
//
// A frame of URDF is given by angles,
//   E = Rz(yaw) Ry(pitch) Rx(roll)                                                         (1)
// Near pitch = +-90 deg, yaw is a quotient of rounding errors. Any yaw will do, though, if the other two
// are those of what it leaves, M = Rz(-yaw) E = Ry(pitch) Rx(roll):
//   yaw = atan2(E21, E11),   pitch = atan2(-M31, M11),   roll = atan2(-M23, M22)           (2)
// The error of the product (1) is then a few roundoffs everywhere.
//
// A joint's reference is part of its frame: E Rz(-ref) of a hinge, d - ref E e3 of a slide.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm {

// (2): roll, pitch and yaw of a rotation.
Vector3<double> urdf_angles(const Matrix3<double>& E);

struct UrdfText {
  std::string text;
  std::vector<std::string> left_out;  // what URDF has no words for: "armature of joint 'hip'"
};

// The base is the link `world`, or, where the robot's only tree hangs on a free joint, the link of that
// joint: who reads the file must give it one. Gravity is no part of a URDF. Links are named like
// their joints, with `_link` behind. nullopt where a ball joint, or a free joint elsewhere, cannot be
// said; `why_not` then names it.
std::optional<UrdfText> to_urdf(const Model<double>& model, const std::string& name,
                                std::string& why_not);

}  // namespace kalmarm
