#include "robots/write_mjcf.hpp"

#include <cstdio>

namespace kalmarm {
namespace {

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::string text_of(const Vector3<double>& v) {
  return text_of(v[0]) + ' ' + text_of(v[1]) + ' ' + text_of(v[2]);
}

std::string text_of(const Eigen::Quaternion<double>& q) {
  return text_of(q.w()) + ' ' + text_of(Vector3<double>(q.vec()));
}

class Writer {
 public:
  explicit Writer(const Model<double>& model) : model_(model) {}

  // The bodies whose joints are on a link, -1: on the world.
  std::string bodies_on(int parent, const std::string& indent) const {
    std::string out;
    for (int k = 0; k < model_.nv(); ++k)
      if (model_.parent(k) == parent && model_.joint(k).coordinate != Coordinate::follower &&
          !turns_of_free(k))
        out += body(k, indent);
    return out;
  }

 private:
  static std::string type(const Joint<double>& joint) {
    switch (joint.coordinate) {
      case Coordinate::position:
        return "free";
      case Coordinate::quaternion:
        return "ball";
      default:
        return joint.slides ? "slide" : "hinge";
    }
  }

  static int dofs(const Joint<double>& joint) {
    const std::string name = type(joint);
    return name == "free" ? 6 : name == "ball" ? 3 : 1;
  }

  bool turns_of_free(int k) const {
    return model_.joint(k).coordinate == Coordinate::quaternion && k >= 3 &&
           model_.joint(k - 3).coordinate == Coordinate::position;
  }

  // The body outboard of the joint whose first DoF is k.
  std::string body(int k, const std::string& indent) const {
    const Joint<double>& joint = model_.joint(k);
    const int link = k + dofs(joint) - 1;
    const RigidBody<double>& body = model_.joint(link).body;
    const std::string name = model_.name(k).substr(0, model_.name(k).find(':'));
    const std::string inside = indent + "  ";
    const bool single = link == k;
    std::string out = indent + "<body name=\"" + name + "\" pos=\"" + text_of(joint.translation) +
                      "\" quat=\"" + text_of(joint.rotation) + "\">\n";
    out += inside + "<inertial pos=\"" + text_of(body.com) + "\" quat=\"" + text_of(body.axes) +
           "\" mass=\"" + text_of(body.mass) + "\" diaginertia=\"" + text_of(body.moments) +
           "\"/>\n";
    out += inside + "<joint name=\"" + name + "\" type=\"" + type(joint) + "\" armature=\"" +
           text_of(joint.r) + '"';
    if (single) out += " axis=\"0 0 1\" ref=\"" + text_of(joint.ref) + '"';
    return out + "/>\n" + bodies_on(link, inside) + indent + "</body>\n";
  }

  const Model<double>& model_;
};

}  // namespace

std::string to_mjcf(const Model<double>& model, const std::string& name) {
  return "<mujoco model=\"" + name + "\">\n  <compiler angle=\"radian\"/>\n  <option gravity=\"" +
         text_of(model.gravity()) + "\"/>\n  <worldbody>\n" + Writer(model).bodies_on(-1, "    ") +
         "  </worldbody>\n</mujoco>\n";
}

}  // namespace kalmarm
