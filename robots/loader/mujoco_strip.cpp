#include "robots/loader/mujoco_strip.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "robots/loader/actuators.hpp"
#include "robots/loader/constraints.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/parts.hpp"
#include "robots/loader/tendons.hpp"

namespace kalmarm {
namespace {

constexpr double not_given = std::numeric_limits<double>::quiet_NaN();

// Whether MuJoCo's compiler counts a geom among those that a body's inertia comes from.
bool weighs(const mjSpec* spec, const mjsGeom* geom) {
  const int* range = spec->compiler.inertiagrouprange;
  if (geom->group < range[0] || geom->group > range[1]) return false;
  return std::isnan(geom->mass) ? geom->density != 0 : geom->mass != 0;
}

// Whether settotalmass counts a body that cannot move. With fusestatic the world takes those in that hang
// on no mocap body, and their mass is lost.
bool counts_in_total(const mjSpec* spec, const mjsBody* body) {
  if (!(spec->compiler.settotalmass > 0)) return false;
  for (; const mjsBody* parent = mjs_getParent(body->element); body = parent)
    if (body->mocap || !spec->compiler.fusestatic) return true;
  return false;
}

// Of a body that cannot move nothing but its mass can count.
void strip_static_inertia(mjsBody* body, bool keeps_mass) {
  const bool weighs = keeps_mass && body->explicitinertial && body->mass > 0;
  body->explicitinertial = weighs;
  if (!weighs) body->mass = 0;
  std::fill(body->ipos, body->ipos + 3, weighs ? 0.0 : not_given);
  std::fill(body->inertia, body->inertia + 3, body->mass);  // a ball
  body->fullinertia[0] = not_given;
}

// The body that a welded one is fused with; itself where it has joints.
mjsBody* carrier(mjsBody* body) {
  while (!has_joint(body)) body = mjs_getParent(body->element);
  return body;
}

// With inertiafromgeom="true" MuJoCo takes the inertia of fused bodies from the geoms of all of them, where
// any weighs, else from the <inertial> of the one that has the joint: what others say is lost.
void strip_lost_inertials(mjSpec* spec) {
  if (spec->compiler.inertiafromgeom != mjINERTIAFROMGEOM_TRUE || !spec->compiler.fusestatic)
    return;
  std::set<mjsBody*> weighed;
  std::vector<mjsBody*> others;
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    if (!moves(body)) continue;
    if (inertia_from_geoms(spec, body))
      weighed.insert(carrier(body));
    else
      others.push_back(body);
  }
  for (mjsBody* body : others) {
    mjsBody* first = carrier(body);
    if (!weighed.contains(first) && (first == body || !(first->mass > 0))) continue;
    body->explicitinertial = 0;
    body->mass = 0;
  }
}

// Those whose force is no part of implicit steps stay for what they add to M and the damping of a joint.
void strip_actuators(mjSpec* spec, bool limits_forces) {
  spec->compiler.LRopt.mode = mjLRMODE_NONE;
  const std::vector<mjsElement*> actuators = elements(spec, mjOBJ_ACTUATOR);
  const std::vector<ActuatorPart> parts = actuator_parts(spec);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    mjsActuator* actuator = mjs_asActuator(actuators[i]);
    if (!limits_forces || !drives_joint(parts[i].transmission))
      actuator->forcelimited = mjLIMITED_FALSE;
    if (parts[i].left_out().empty()) continue;
    const bool adds = parts[i].armature != 0 || parts[i].damping != 0;
    if (adds && (parts[i].transmission == mjTRN_JOINT || parts[i].drives_row()))
      mute(actuator);
    else
      mjs_delete(spec, actuators[i]);
  }
  if (limits_forces) return;
  for (mjsElement* e : elements(spec, mjOBJ_JOINT)) mjs_asJoint(e)->actfrclimited = mjLIMITED_FALSE;
}

// Of keyframes nothing stays but their number: to delete one takes MuJoCo time by all that are left.
void empty_keys(mjSpec* spec) {
  for (mjsElement* e : elements(spec, mjOBJ_KEY)) {
    const mjsKey* key = mjs_asKey(e);
    for (mjDoubleVec* of : {key->qpos, key->qvel, key->act, key->mpos, key->mquat, key->ctrl})
      mjs_setDouble(of, nullptr, 0);
  }
}

// Those stay that are rows and move something.
void strip_tendons(mjSpec* spec) {
  const std::vector<mjsElement*> tendons = elements(spec, mjOBJ_TENDON);
  const std::vector<TendonPart> parts = tendon_parts(spec);
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (parts[i].is_row())
      strip(mjs_asTendon(tendons[i]));
    else
      mjs_delete(spec, tendons[i]);
}

}  // namespace

bool inertia_from_geoms(const mjSpec* spec, mjsBody* body) {
  const int policy = spec->compiler.inertiafromgeom;
  if (policy == mjINERTIAFROMGEOM_FALSE) return false;
  if (policy != mjINERTIAFROMGEOM_TRUE && body->explicitinertial) return false;
  for (mjsElement* e = mjs_firstChild(body, mjOBJ_GEOM, 0); e; e = mjs_nextChild(body, e, 0))
    if (weighs(spec, mjs_asGeom(e))) return true;
  return false;
}

void strip_inertias(mjSpec* spec, bool keeps_static_mass) {
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    const bool is_used = moves(body) || (keeps_static_mass && counts_in_total(spec, body));
    const bool from_geoms = is_used && inertia_from_geoms(spec, body);
    std::vector<mjsElement*> geoms;
    for (mjsElement* g = mjs_firstChild(body, mjOBJ_GEOM, 0); g; g = mjs_nextChild(body, g, 0))
      geoms.push_back(g);
    for (mjsElement* g : geoms) {
      mjsGeom* geom = mjs_asGeom(g);
      if (!from_geoms || !weighs(spec, geom)) {
        mjs_delete(spec, g);
        continue;
      }
      mjs_setString(geom->material, "");
      geom->contype = geom->conaffinity = 0;
    }
    if (!moves(body) && !from_geoms) strip_static_inertia(body, is_used);
  }
  strip_lost_inertials(spec);
  std::vector<std::string> meshes;
  for (mjsElement* e : elements(spec, mjOBJ_GEOM))
    meshes.push_back(mjs_getString(mjs_asGeom(e)->meshname));
  for (mjsElement* e : elements(spec, mjOBJ_MESH))
    if (std::find(meshes.begin(), meshes.end(), name_of(e)) == meshes.end())
      mjs_delete(spec, e);
    else
      mjs_setString(mjs_asMesh(e)->material, "");
}

void strip(mjSpec* spec, Frames frames, const LoadOptions& options) {
  refuse_coupling_armature(actuator_parts(spec), tendon_parts(spec), options.takes_steps);
  // As much as the compiler needs, whatever a simulation is given.
  spec->memory = -1;
  spec->nstack = spec->njmax = spec->nconmax = -1;
  for (int* size :
       {&spec->nuser_body, &spec->nuser_jnt, &spec->nuser_geom, &spec->nuser_site, &spec->nuser_cam,
        &spec->nuser_tendon, &spec->nuser_actuator, &spec->nuser_sensor})
    *size = -1;
  spec->nuserdata = 0;
  spec->nkey = 0;
  empty_keys(spec);
  spec->compiler.discardvisual = 0;  // of a URDF: the geoms that stay have a mass
  for (mjsElement* e : elements(spec, mjOBJ_JOINT))
    if (mjsJoint* joint = mjs_asJoint(e); joint->type == mjJNT_BALL) {
      joint->limited = mjLIMITED_FALSE;  // its limit may be one that MuJoCo does not have
      joint->range[0] = joint->range[1] = 0;
    }
  for (const mjtObj type :
       {mjOBJ_SENSOR, mjOBJ_TUPLE, mjOBJ_NUMERIC, mjOBJ_TEXT, mjOBJ_EXCLUDE, mjOBJ_PAIR})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);
  for (mjsElement* e : elements(spec, mjOBJ_EQUALITY))
    if (const mjsEquality* equality = mjs_asEquality(e);
        !equality->active || !is_taken(equality->type, options))
      mjs_delete(spec, e);
  strip_actuators(spec, options.limits_forces);
  strip_tendons(spec);
  for (const mjtObj type : {mjOBJ_SKIN, mjOBJ_CAMERA, mjOBJ_LIGHT})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);
  for (mjsElement* e : elements(spec, mjOBJ_SITE))
    if (frames == Frames::kept)
      mjs_setString(mjs_asSite(e)->material, "");
    else
      mjs_delete(spec, e);

  strip_inertias(spec, true);
  for (const mjtObj type : {mjOBJ_MATERIAL, mjOBJ_TEXTURE, mjOBJ_HFIELD})
    for (mjsElement* e : elements(spec, type)) mjs_delete(spec, e);
}

}  // namespace kalmarm
