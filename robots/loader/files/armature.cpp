#include "robots/loader/files/armature.hpp"

#include <cmath>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/names.hpp"

namespace kalmarm {

void set_armature(mjSpec* spec, const std::map<std::string, double>& armature) {
  std::vector<std::string> names;
  for (mjsElement* e : elements(spec, mjOBJ_JOINT)) {
    names.push_back(name_of(e));
    if (const auto given = armature.find(names.back()); given != armature.end())
      mjs_asJoint(e)->armature = given->second;
  }
  for (const auto& [joint, value] : armature) {
    if (std::find(names.begin(), names.end(), joint) == names.end())
      throw InputError(unknown_name("armature: joint", joint, names));
    if (!(value >= 0 && std::isfinite(value)))
      throw InputError("armature of joint '" + joint + "': " + std::to_string(value) +
                       " must not be negative");
  }
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR)) {
    mjsActuator* actuator = mjs_asActuator(e);
    if (actuator->trntype == mjTRN_JOINT && armature.contains(mjs_getString(actuator->target)))
      actuator->armature = 0;
  }
}

}  // namespace kalmarm
