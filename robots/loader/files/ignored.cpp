#include "robots/loader/files/ignored.hpp"

#include "robots/loader/constraints.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/names.hpp"

namespace kalmarm {
namespace {

const char* name_of_equality(int type) {
  switch (type) {
    case mjEQ_CONNECT:
      return "connect constraint";
    case mjEQ_WELD:
      return "weld constraint";
    case mjEQ_JOINT:
      return "coupling of joints";
    case mjEQ_TENDON:
      return "coupling of tendons";
    default:
      return "equality of another kind";
  }
}

}  // namespace

std::string note_of_loose_couplings(mjSpec* spec) {
  std::string out;
  for (mjsElement* e : elements(spec, mjOBJ_EQUALITY)) {
    const mjsEquality* equality = mjs_asEquality(e);
    if (equality->type != mjEQ_JOINT) continue;
    for (const mjString* joint : {equality->name1, equality->name2}) {
      const std::string name = mjs_getString(joint);
      if (name.empty() || mjs_findElement(spec, mjOBJ_JOINT, name.c_str())) continue;
      out += (out.empty() ? "" : ", ") + ("'" + name + "'");
    }
  }
  return out.empty() ? "" : "joints that others are coupled to, and that are not there: " + out;
}

std::string ignored_parts(const MovingParts& parts, const LoadOptions& options) {
  Counts things, forces;
  for (const int type : parts.equalities)
    if (!(options.imposes_couplings && type == mjEQ_JOINT) && !is_taken(type, options))
      things.add(name_of_equality(type));
  int limited = 0;  // actuators, by themselves
  for (const ActuatorPart& actuator : parts.actuators) {
    const std::string why = actuator.left_out();
    if (!options.takes_steps)
      things.add("actuator");
    else if (!why.empty() && !actuator.is_off)
      things.add(why);
    limited += options.takes_steps && why.empty() && actuator.has_force_limit &&
               !(options.limits_forces && drives_joint(actuator.transmission));
  }
  for (const TendonPart& tendon : parts.tendons) {
    const std::string why = tendon.left_out();
    if (!options.takes_steps || (why.empty() ? !tendon.is_row() : !tendon.has_force()))
      things.add("tendon");
    else if (!why.empty())
      things.add(why);
    else if (tendon.friction != 0)
      things.add("tendon with friction");
  }
  things.add("flex", parts.flexes);
  for (const JointPart& joint : parts.joints) {
    if (joint.damping != 0 && !options.adds_friction && !options.takes_steps) forces.add("damping");
    if (joint.friction != 0 && !options.adds_friction) forces.add("friction");
    if (joint.stiffness != 0 && !(joint.is_single && options.takes_steps)) forces.add("springs");
    if (options.takes_steps && joint.has_force_limit && !(options.limits_forces && joint.is_single))
      forces.add("limits of actuators' forces");
    if (joint.is_nonlinear) forces.add("nonlinear springs or damping");
  }
  int compensated = 0;
  for (const double share : parts.gravcomp)
    compensated += options.takes_steps ? share < 0 : share != 0;

  std::string out;
  const auto add = [&](const std::string& text) { out += (out.empty() ? "" : ", ") + text; };
  for (const auto& [name, count] : things.all()) add(counted(count, name));
  for (const auto& [name, count] : forces.all()) add(name + " of " + counted(count, "joint"));
  if (limited > 0) add("force limits of " + counted(limited, "actuator"));
  const char* const negative = options.takes_steps ? "negative " : "";
  if (compensated > 0)
    add(negative + std::string("gravity compensation of ") + counted(compensated, "body"));
  if (parts.has_drag) add("drag of a medium");
  return out;
}

}  // namespace kalmarm
