#include "robots/files/ignored.hpp"

#include <utility>
#include <vector>

#include "robots/mujoco_shim.hpp"
#include "robots/mujoco_spec.hpp"

namespace kalmarm {
namespace {

const char* name_of(mjtEq type) {
  switch (type) {
    case mjEQ_CONNECT:
      return "connect";
    case mjEQ_WELD:
      return "weld";
    case mjEQ_JOINT:
      return "coupling of joints";
    case mjEQ_TENDON:
      return "coupling of tendons";
    default:
      return "equality of another kind";
  }
}

// Numbers of things by their names, in the order in which they were first seen.
class Counts {
 public:
  void add(const std::string& name) {
    for (auto& [known, count] : counts_)
      if (known == name) return void(++count);
    counts_.emplace_back(name, 1);
  }

  const std::vector<std::pair<std::string, int>>& all() const { return counts_; }

 private:
  std::vector<std::pair<std::string, int>> counts_;
};

}  // namespace

std::string ignored_parts(mjSpec* spec) {
  Counts things, forces;
  for (mjsElement* e : elements(spec, mjOBJ_EQUALITY))
    if (const mjsEquality* equality = mjs_asEquality(e); equality->active)
      things.add(name_of(equality->type));
  for (const auto& [type, name] :
       {std::pair{mjOBJ_ACTUATOR, "actuator"}, {mjOBJ_TENDON, "tendon"}, {mjOBJ_FLEX, "flex"}})
    for (std::size_t i = elements(spec, type).size(); i > 0; --i) things.add(name);
  for (mjsElement* e : elements(spec, mjOBJ_JOINT)) {
    mjsJoint* joint = mjs_asJoint(e);
    if (linear(joint->damping) != 0) forces.add("damping");
    if (joint->frictionloss != 0) forces.add("friction");
    if (linear(joint->stiffness) != 0) forces.add("springs");
  }
  int compensated = 0;
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) compensated += mjs_asBody(e)->gravcomp != 0;

  std::string out;
  const auto add = [&](const std::string& text) { out += (out.empty() ? "" : ", ") + text; };
  for (const auto& [name, count] : things.all()) {
    const bool has_plural = name == "actuator" || name == "tendon";
    add(std::to_string(count) + " " + name + (has_plural && count > 1 ? "s" : ""));
  }
  for (const auto& [name, count] : forces.all())
    add(name + " of " + std::to_string(count) + (count > 1 ? " joints" : " joint"));
  if (compensated > 0)
    add("gravity compensation of " + std::to_string(compensated) +
        (compensated > 1 ? " bodies" : " body"));
  if (spec->option.density != 0 || spec->option.viscosity != 0) add("drag of a medium");
  return out;
}

}  // namespace kalmarm
