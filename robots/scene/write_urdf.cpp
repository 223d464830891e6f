#include "robots/scene/write_urdf.hpp"

#include <cmath>

#include "robots/scene/file_text.hpp"
#include "robots/scene/write_mjcf.hpp"

namespace kalmarm {
namespace {

std::string origin(const Vector3<double>& xyz, const Vector3<double>& rpy) {
  return "<origin xyz=\"" + text_of(xyz) + "\" rpy=\"" + text_of(rpy) + "\"/>";
}

std::string link_of(const std::string& joint) { return joint + "_link"; }

std::string link(const std::string& name, const RigidBody<double>& body) {
  if (body.massless()) return "  <link name=\"" + name + "\"/>\n";
  const Matrix3<double> E = rotation(body.axes);
  const Matrix3<double> I = E * body.moments.asDiagonal() * E.transpose();
  const auto entry = [&](const char* key, int i, int j) {
    return std::string(" ") + key + "=\"" + text_of((I(i, j) + I(j, i)) / 2) + '"';
  };
  return "  <link name=\"" + name + "\">\n    <inertial>\n      " +
         origin(body.com, Vector3<double>::Zero()) + "\n      <mass value=\"" + text_of(body.mass) +
         "\"/>\n      <inertia" + entry("ixx", 0, 0) + entry("ixy", 0, 1) + entry("ixz", 0, 2) +
         entry("iyy", 1, 1) + entry("iyz", 1, 2) + entry("izz", 2, 2) +
         "/>\n    </inertial>\n  </link>\n";
}

// A range in which every state lies: without one a hinge would be of another type, whose position some
// engines hold as a cosine and a sine.
constexpr const char* limit =
    R"(<limit lower="-1000" upper="1000" effort="1000" velocity="1000"/>)";

std::string joint_text(const Joint<double>& joint, const std::string& name,
                       const std::string& parent) {
  const Matrix3<double> E = rotation(joint.rotation);
  const Vector3<double> d =
      joint.slides ? (joint.translation - joint.ref * E.col(2)).eval() : joint.translation;
  const Matrix3<double> turned =
      joint.slides ? E
                   : (E * Eigen::AngleAxis<double>(-joint.ref, Vector3<double>::UnitZ())).eval();
  return "  <joint name=\"" + name + "\" type=\"" + (joint.slides ? "prismatic" : "revolute") +
         "\">\n    " + origin(d, urdf_angles(turned)) + "\n    <parent link=\"" + parent +
         "\"/>\n    <child link=\"" + link_of(name) + "\"/>\n    <axis xyz=\"0 0 1\"/>\n    " +
         limit + "\n  </joint>\n";
}

}  // namespace

Vector3<double> urdf_angles(const Matrix3<double>& E) {
  const double yaw = std::atan2(E(1, 0), E(0, 0));
  const Matrix3<double> M =
      Eigen::AngleAxis<double>(-yaw, Vector3<double>::UnitZ()).toRotationMatrix() * E;
  return {std::atan2(-M(1, 2), M(1, 1)), std::atan2(-M(2, 0), M(0, 0)), yaw};
}

std::optional<UrdfText> to_urdf(const Model<double>& model, const std::string& name,
                                std::string& why_not) {
  const bool floats = std::string(file_joint(model.joint(0)).type) == "free";
  UrdfText out;
  std::string links, joints;
  if (!floats) links = "  <link name=\"world\"/>\n";
  for (int k = 0; k < model.nv();) {
    const Joint<double>& joint = model.joint(k);
    const auto [type, dofs] = file_joint(joint);
    const std::string own = joint_name(model, k);
    if (dofs > 1 && k > 0) {
      why_not = std::string(type) + " joint '" + own + "'";
      return std::nullopt;
    }
    if (dofs == 3) {
      why_not = "ball joint '" + own + "'";
      return std::nullopt;
    }
    if (floats && k > 0 && joint.parent < 0) {
      why_not = "free joint '" + joint_name(model, 0) + "' beside joint '" + own + "'";
      return std::nullopt;
    }
    if (joint.r > 0) out.left_out.push_back("armature of joint '" + own + "'");
    links += link(link_of(own), model.joint(k + dofs - 1).body);
    if (dofs == 1)
      joints += joint_text(joint, own,
                           joint.parent < 0 ? "world" : link_of(joint_name(model, joint.parent)));
    k += dofs;
  }
  out.text =
      "<?xml version=\"1.0\"?>\n<robot name=\"" + name + "\">\n" + links + joints + "</robot>\n";
  return out;
}

}  // namespace kalmarm
