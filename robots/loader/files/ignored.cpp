#include "robots/loader/files/ignored.hpp"

#include "robots/loader/actuators.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/names.hpp"
#include "robots/loader/tendons.hpp"

namespace kalmarm {
namespace {

const char* name_of(mjtEq type) {
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

std::string ignored_parts(mjSpec* spec, const LoadOptions& options) {
  Counts things, forces;
  for (mjsElement* e : elements(spec, mjOBJ_EQUALITY))
    if (const mjsEquality* equality = mjs_asEquality(e);
        equality->active && !(options.imposes_couplings && equality->type == mjEQ_JOINT))
      things.add(name_of(equality->type));
  int limited = 0;  // actuators, by themselves
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR)) {
    const mjsActuator* actuator = mjs_asActuator(e);
    const std::string why = left_out(spec, actuator);
    if (!options.takes_steps)
      things.add("actuator");
    else if (!why.empty() && !is_switched_off(spec, actuator))
      things.add(why);
    limited += options.takes_steps && why.empty() && has_force_limit(spec, actuator);
  }
  for (mjsElement* e : elements(spec, mjOBJ_TENDON)) {
    const mjsTendon* tendon = mjs_asTendon(e);
    const std::string why = left_out(tendon);
    if (!options.takes_steps ||
        (why.empty() ? !has_force(tendon) && !is_driven(spec, tendon) : !has_force(tendon)))
      things.add("tendon");
    else if (!why.empty())
      things.add(why);
    else if (tendon->frictionloss != 0)
      things.add("tendon with friction");
  }
  things.add("flex", count(spec, mjOBJ_FLEX));
  for (mjsElement* e : elements(spec, mjOBJ_JOINT)) {
    mjsJoint* joint = mjs_asJoint(e);
    if (linear(joint->damping) != 0 && !options.adds_friction && !options.takes_steps)
      forces.add("damping");
    if (joint->frictionloss != 0 && !options.adds_friction) forces.add("friction");
    const bool single = joint->type == mjJNT_HINGE || joint->type == mjJNT_SLIDE;
    if (linear(joint->stiffness) != 0 && !(single && options.takes_steps)) forces.add("springs");
    if (options.takes_steps && has_force_limit(spec, joint))
      forces.add("limits of actuators' forces");
    if (is_nonlinear(joint->stiffness) || is_nonlinear(joint->damping))
      forces.add("nonlinear springs or damping");
  }
  int compensated = 0;
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    const double share = mjs_asBody(e)->gravcomp;
    compensated += options.takes_steps ? share < 0 : share != 0;
  }

  std::string out;
  const auto add = [&](const std::string& text) { out += (out.empty() ? "" : ", ") + text; };
  for (const auto& [name, count] : things.all()) add(counted(count, name));
  for (const auto& [name, count] : forces.all()) add(name + " of " + counted(count, "joint"));
  if (limited > 0) add("force limits of " + counted(limited, "actuator"));
  const char* const negative = options.takes_steps ? "negative " : "";
  if (compensated > 0)
    add(negative + std::string("gravity compensation of ") + counted(compensated, "body"));
  if (spec->option.density != 0 || spec->option.viscosity != 0) add("drag of a medium");
  return out;
}

}  // namespace kalmarm
