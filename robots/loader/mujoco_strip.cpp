#include "robots/loader/mujoco_strip.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "robots/loader/actuators.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/tendons.hpp"

namespace kalmarm {
namespace {

// Whether an actuator acts along a tendon that is a row.
bool drives_row(mjSpec* spec, const mjsActuator* actuator) {
  if (actuator->trntype != mjTRN_TENDON) return false;
  mjsElement* tendon = mjs_findElement(spec, mjOBJ_TENDON, mjs_getString(actuator->target));
  return tendon && left_out(mjs_asTendon(tendon)).empty();
}

void refuse_coupling_armature(mjSpec* spec, bool takes_steps) {
  for (mjsElement* e : elements(spec, mjOBJ_TENDON)) {
    const mjsTendon* tendon = mjs_asTendon(e);
    if (tendon->armature == 0) continue;
    const std::string why = left_out(tendon);
    if (takes_steps && why.empty()) continue;
    throw InputError(
        "tendon '" + name_of(e) + "' has armature " + std::to_string(tendon->armature) +
        ", which couples joints in M: " +
        (why.empty() ? "supported in implicit steps alone" : "not supported of a " + why));
  }
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR)) {
    const mjsActuator* actuator = mjs_asActuator(e);
    if (takes_steps && drives_row(spec, actuator)) continue;
    if (actuator->armature != 0 && actuator->trntype != mjTRN_JOINT)
      throw InputError("actuator '" + name_of(e) + "' has armature " +
                       std::to_string(actuator->armature) +
                       " but does not drive a joint: not supported");
  }
}

// Bodies that cannot move need no inertia, and files often give them one that is none. Parents come
// before their children.
std::vector<const mjsBody*> strip_static_inertias(mjSpec* spec) {
  std::vector<const mjsBody*> fixed = {mjs_findBody(spec, "world")};
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    const bool moves = mjs_firstChild(body, mjOBJ_JOINT, 0) != nullptr;
    const mjsBody* parent = mjs_getParent(e);
    if (moves || std::find(fixed.begin(), fixed.end(), parent) == fixed.end()) continue;
    fixed.push_back(body);
    body->explicitinertial = 0;
    body->mass = 0;
    body->ipos[0] = body->fullinertia[0] = std::numeric_limits<double>::quiet_NaN();  // not given
    std::fill(body->inertia, body->inertia + 3, 0.0);
  }
  return fixed;
}

// Those whose force is no part of implicit steps stay for what they add to M and the damping of a joint.
void strip_actuators(mjSpec* spec) {
  spec->compiler.LRopt.mode = mjLRMODE_NONE;
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR)) {
    mjsActuator* actuator = mjs_asActuator(e);
    actuator->forcelimited = mjLIMITED_FALSE;
    if (left_out(spec, actuator).empty()) continue;
    const bool adds = actuator->armature != 0 || linear(actuator->damping) != 0;
    if (adds && (actuator->trntype == mjTRN_JOINT || drives_row(spec, actuator)))
      mute(actuator);
    else
      mjs_delete(spec, e);
  }
  for (mjsElement* e : elements(spec, mjOBJ_JOINT)) mjs_asJoint(e)->actfrclimited = mjLIMITED_FALSE;
}

// Those stay that are rows and move something.
void strip_tendons(mjSpec* spec) {
  for (mjsElement* e : elements(spec, mjOBJ_TENDON)) {
    mjsTendon* tendon = mjs_asTendon(e);
    if (left_out(tendon).empty() && (has_force(tendon) || is_driven(spec, tendon)))
      strip(tendon);
    else
      mjs_delete(spec, e);
  }
}

}  // namespace

bool inertia_from_geoms(const mjSpec* spec, const mjsBody* body) {
  switch (spec->compiler.inertiafromgeom) {
    case mjINERTIAFROMGEOM_FALSE:
      return false;
    case mjINERTIAFROMGEOM_TRUE:
      return true;
    default:
      return !body->explicitinertial;
  }
}

void strip(mjSpec* spec, Sites sites, bool takes_steps) {
  refuse_coupling_armature(spec, takes_steps);
  spec->memory = -1;  // as much as the compiler needs, whatever a simulation is given
  for (mjsElement* e : elements(spec, mjOBJ_JOINT))
    if (mjsJoint* joint = mjs_asJoint(e); joint->type == mjJNT_BALL) {
      joint->limited = mjLIMITED_FALSE;  // its limit may be one that MuJoCo does not have
      joint->range[0] = joint->range[1] = 0;
    }
  for (const mjtObj type : {mjOBJ_KEY, mjOBJ_SENSOR, mjOBJ_TUPLE, mjOBJ_NUMERIC, mjOBJ_TEXT,
                            mjOBJ_EXCLUDE, mjOBJ_PAIR, mjOBJ_EQUALITY})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);
  strip_actuators(spec);
  strip_tendons(spec);
  for (const mjtObj type : {mjOBJ_SKIN, mjOBJ_CAMERA, mjOBJ_LIGHT})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);
  for (mjsElement* e : elements(spec, mjOBJ_SITE))
    if (sites == Sites::kept)
      mjs_setString(mjs_asSite(e)->material, "");
    else
      mjs_delete(spec, e);

  const std::vector<const mjsBody*> fixed = strip_static_inertias(spec);
  std::vector<std::string> meshes;
  for (mjsElement* e : elements(spec, mjOBJ_GEOM)) {
    mjsGeom* geom = mjs_asGeom(e);
    const mjsBody* body = mjs_getParent(e);
    const bool is_fixed = std::find(fixed.begin(), fixed.end(), body) != fixed.end();
    if (is_fixed || !inertia_from_geoms(spec, body)) {
      mjs_delete(spec, e);
      continue;
    }
    mjs_setString(geom->material, "");
    geom->contype = geom->conaffinity = 0;
    meshes.push_back(mjs_getString(geom->meshname));
  }
  for (mjsElement* e : elements(spec, mjOBJ_MESH))
    if (std::find(meshes.begin(), meshes.end(), name_of(e)) == meshes.end())
      mjs_delete(spec, e);
    else
      mjs_setString(mjs_asMesh(e)->material, "");
  for (const mjtObj type : {mjOBJ_MATERIAL, mjOBJ_TEXTURE, mjOBJ_HFIELD})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);
}

}  // namespace kalmarm
