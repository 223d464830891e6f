#include "robots/scene/write_mjcf.hpp"

#include <vector>

#include "robots/scene/file_text.hpp"

namespace kalmarm {
namespace {

// The body outboard of the joint whose first DoF is k, without the bodies on it and its end.
std::string opened(const Model<double>& model, int k, const std::string& indent) {
  const Joint<double>& joint = model.joint(k);
  const auto [type, dofs] = file_joint(joint);
  const RigidBody<double>& body = model.joint(k + dofs - 1).body;
  const std::string name = joint_name(model, k);
  std::string out = indent + "<body name=\"" + name + "\" pos=\"" + text_of(joint.translation) +
                    "\" quat=\"" + text_of(joint.rotation) + "\">\n";
  out += indent + "  <inertial pos=\"" + text_of(body.com) + "\" quat=\"" + text_of(body.axes) +
         "\" mass=\"" + text_of(body.mass) + "\" diaginertia=\"" + text_of(body.moments) + "\"/>\n";
  out += indent + "  <joint name=\"" + name + "\" type=\"" + type + "\" armature=\"" +
         text_of(joint.r) + '"';
  if (dofs == 1) out += " axis=\"0 0 1\" ref=\"" + text_of(joint.ref) + '"';
  return out + "/>\n";
}

// One after another, since they are numbered depth first.
std::string bodies(const Model<double>& model) {
  std::string out;
  std::vector<int> open;  // links whose bodies have not ended
  const auto indent = [&] { return std::string(4 + 2 * open.size(), ' '); };
  const auto close = [&] {
    open.pop_back();
    out += indent() + "</body>\n";
  };
  for (int k = 0; k < model.nv(); k += file_joint(model.joint(k)).dofs) {
    while (!open.empty() && open.back() != model.parent(k)) close();
    out += opened(model, k, indent());
    open.push_back(k + file_joint(model.joint(k)).dofs - 1);
  }
  while (!open.empty()) close();
  return out;
}

}  // namespace

FileJoint file_joint(const Joint<double>& joint) {
  if (joint.coordinate == Coordinate::position) return {"free", 6};
  if (joint.coordinate == Coordinate::quaternion) return {"ball", 3};
  return {joint.slides ? "slide" : "hinge", 1};
}

std::string to_mjcf(const Model<double>& model, const std::string& name) {
  return "<mujoco model=\"" + name + "\">\n  <compiler angle=\"radian\"/>\n  <option gravity=\"" +
         text_of(model.gravity()) + "\"/>\n  <worldbody>\n" + bodies(model) +
         "  </worldbody>\n</mujoco>\n";
}

}  // namespace kalmarm
