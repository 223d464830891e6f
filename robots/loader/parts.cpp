#include "robots/loader/parts.hpp"

#include <algorithm>
#include <set>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"

namespace kalmarm {
namespace {

std::string name_in(const mjModel* m, mjtObj kind, int i) {
  const char* name = mj_id2name(m, kind, i);
  return name ? name : "";
}

bool is_limited(const mjSpec* spec, int limited, const double range[2]) {
  return limited == mjLIMITED_TRUE ||
         (limited == mjLIMITED_AUTO && spec->compiler.autolimits && range[0] < range[1]);
}

bool any_of_polynomial(const mjtNum* coefficients, int i) {
  const mjtNum* first = coefficients + static_cast<std::ptrdiff_t>(i) * mjNPOLY;
  return std::any_of(first, first + mjNPOLY, [](mjtNum c) { return c != 0; });
}

bool is_switched_off(const mjOption& option, int group) {
  const bool grouped = group >= 0 && group < 31;
  return (option.disableflags & mjDSBL_ACTUATION) != 0 ||
         (grouped && (option.disableactuator & (1 << group)) != 0);
}

bool is_affine(int gain, int bias) {
  return (gain == mjGAIN_FIXED || gain == mjGAIN_AFFINE) &&
         (bias == mjBIAS_NONE || bias == mjBIAS_AFFINE);
}

// What an actuator drives that has no terms.
std::string other_target(int transmission) {
  switch (transmission) {
    case mjTRN_SLIDERCRANK:
      return "actuator of a slider-crank";
    case mjTRN_SITE:
      return "actuator of a site";
    case mjTRN_BODY:
      return "actuator of a body";
    default:
      return "actuator of another kind";
  }
}
std::string of_tendon(const TendonPart& tendon) {
  const std::string why = tendon.left_out();
  return why.empty() ? "" : "actuator of a " + why;
}
std::string of_joint(int type) {
  return has_one_axis(type) ? "" : "actuator of a joint of several axes";
}

TendonPart part_of(const mjsTendon* t) {
  const int count = mjs_getWrapNum(t);
  bool is_fixed = count > 0;
  for (int i = 0; i < count; ++i) is_fixed &= mjs_getWrap(t, i)->type == mjWRAP_JOINT;
  return {.name = name_of(t->element),
          .is_fixed = is_fixed,
          .is_nonlinear = is_nonlinear(t->stiffness) || is_nonlinear(t->damping),
          .is_band = t->springlength[0] < t->springlength[1],
          .stiffness = linear(t->stiffness),
          .damping = linear(t->damping),
          .armature = t->armature,
          .yield = yield_of(*t),
          .friction = t->frictionloss};
}

TendonPart part_of(const mjModel* m, int t) {
  const int first = m->tendon_adr[t], count = m->tendon_num[t];
  const mjtNum* length = m->tendon_lengthspring + 2 * static_cast<std::ptrdiff_t>(t);
  return {.name = name_in(m, mjOBJ_TENDON, t),
          .is_fixed = std::all_of(m->wrap_type + first, m->wrap_type + first + count,
                                  [](int type) { return type == mjWRAP_JOINT; }),
          .is_nonlinear = any_of_polynomial(m->tendon_stiffnesspoly, t) ||
                          any_of_polynomial(m->tendon_dampingpoly, t),
          .is_band = length[0] < length[1],
          .stiffness = m->tendon_stiffness[t],
          .damping = m->tendon_damping[t],
          .armature = m->tendon_armature[t],
          .yield = yield_of_tendon(*m, t),
          .friction = m->tendon_frictionloss[t]};
}

ActuatorPart part_of(mjSpec* spec, const mjsActuator* a) {
  ActuatorPart out = {.name = name_of(a->element),
                      .transmission = a->trntype,
                      .no_target = {},
                      .is_off = is_switched_off(spec->option, a->group),
                      .is_plugin = a->plugin.active != 0,
                      .is_dynamic = a->dyntype != mjDYN_NONE,
                      .is_late = a->nsample != 0 || a->delay != 0,
                      .is_affine = is_affine(a->gaintype, a->biastype),
                      .has_nonlinear_damping = is_nonlinear(a->damping),
                      .has_force_limit = is_limited(spec, a->forcelimited, a->forcerange),
                      .armature = a->armature,
                      .damping = linear(a->damping)};
  const char* const target = mjs_getString(a->target);
  if (a->trntype == mjTRN_TENDON) {
    mjsElement* e = mjs_findElement(spec, mjOBJ_TENDON, target);
    if (!e) return out.no_target = "actuator of a tendon that is not there", out;
    const mjsTendon* tendon = mjs_asTendon(e);
    out.no_target = of_tendon(part_of(tendon));
    out.has_force_limit |= is_limited(spec, tendon->actfrclimited, tendon->actfrcrange);
  } else if (drives_joint(a->trntype)) {
    mjsElement* e = mjs_findElement(spec, mjOBJ_JOINT, target);
    out.no_target = e ? of_joint(mjs_asJoint(e)->type) : "actuator of a joint that is not there";
  } else {
    out.no_target = other_target(a->trntype);
  }
  return out;
}

ActuatorPart part_of_actuator(const mjModel* m, int i) {
  const int transmission = m->actuator_trntype[i],
            target = m->actuator_trnid[2 * static_cast<std::ptrdiff_t>(i)];
  ActuatorPart out = {.name = name_in(m, mjOBJ_ACTUATOR, i),
                      .transmission = transmission,
                      .no_target = {},
                      .is_off = is_switched_off(m->opt, m->actuator_group[i]),
                      .is_plugin = m->actuator_plugin[i] >= 0,
                      .is_dynamic = m->actuator_dyntype[i] != mjDYN_NONE,
                      .is_late = m->actuator_history[2 * static_cast<std::ptrdiff_t>(i)] != 0 ||
                                 m->actuator_delay[i] != 0,
                      .is_affine = is_affine(m->actuator_gaintype[i], m->actuator_biastype[i]),
                      .has_nonlinear_damping = any_of_polynomial(m->actuator_dampingpoly, i),
                      .has_force_limit = m->actuator_forcelimited[i] != 0,
                      .armature = m->actuator_armature[i],
                      .damping = m->actuator_damping[i]};
  if (transmission == mjTRN_TENDON) {
    out.no_target = of_tendon(part_of(m, target));
    out.has_force_limit |= m->tendon_actfrclimited[target] != 0;
  } else {
    out.no_target =
        drives_joint(transmission) ? of_joint(m->jnt_type[target]) : other_target(transmission);
  }
  return out;
}

JointPart part_of(const mjSpec* spec, const mjsJoint* j) {
  return {.is_single = has_one_axis(j->type),
          .damping = linear(j->damping),
          .stiffness = linear(j->stiffness),
          .friction = j->frictionloss,
          .is_nonlinear = is_nonlinear(j->stiffness) || is_nonlinear(j->damping),
          .has_force_limit = is_limited(spec, j->actfrclimited, j->actfrcrange)};
}

JointPart part_of_joint(const mjModel* m, int j) {
  const int dof = m->jnt_dofadr[j];  // all of a joint's have the same
  return {.is_single = has_one_axis(m->jnt_type[j]),
          .damping = m->dof_damping[dof],
          .stiffness = m->jnt_stiffness[j],
          .friction = m->dof_frictionloss[dof],
          .is_nonlinear = any_of_polynomial(m->jnt_stiffnesspoly, j) ||
                          any_of_polynomial(m->dof_dampingpoly, dof),
          .has_force_limit = m->jnt_actfrclimited[j] != 0};
}

}  // namespace

std::string TendonPart::left_out() const {
  if (!is_fixed) return "spatial tendon";
  if (is_nonlinear) return "tendon with nonlinear springs or damping";
  if (stiffness < 0 || damping < 0) return "tendon with negative stiffness or damping";
  if (stiffness > 0 && yield != 0) return "plastic tendon";
  return stiffness > 0 && is_band ? "tendon with a dead band" : "";
}

bool TendonPart::has_force() const {
  return stiffness != 0 || damping != 0 || armature != 0 || is_nonlinear;
}

std::string ActuatorPart::left_out() const {
  if (is_off) return "actuator of a group that is switched off";
  if (!no_target.empty()) return no_target;
  if (is_plugin) return "actuator of a plugin";
  if (is_dynamic) return "actuator with activation dynamics";
  if (is_late) return "actuator with a delay";
  if (has_nonlinear_damping) return "actuator with nonlinear damping";
  return is_affine ? "" : "actuator with a force that is not affine";
}

std::vector<TendonPart> tendon_parts(mjSpec* spec) {
  std::set<std::string> driven;
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR))
    if (const mjsActuator* a = mjs_asActuator(e); a->trntype == mjTRN_TENDON)
      driven.insert(mjs_getString(a->target));
  std::vector<TendonPart> out;
  for (mjsElement* e : elements(spec, mjOBJ_TENDON)) {
    out.push_back(part_of(mjs_asTendon(e)));
    out.back().is_driven = driven.contains(out.back().name);
  }
  return out;
}

std::vector<TendonPart> tendon_parts(const mjModel* m) {
  std::vector<TendonPart> out;
  out.reserve(m->ntendon);
  for (int t = 0; t < m->ntendon; ++t) out.push_back(part_of(m, t));
  for (int i = 0; i < actuator_count(m); ++i)
    if (m->actuator_trntype[i] == mjTRN_TENDON)
      out[m->actuator_trnid[2 * static_cast<std::ptrdiff_t>(i)]].is_driven = true;
  return out;
}

std::vector<ActuatorPart> actuator_parts(mjSpec* spec) {
  std::vector<ActuatorPart> out;
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR))
    out.push_back(part_of(spec, mjs_asActuator(e)));
  return out;
}

std::vector<ActuatorPart> actuator_parts(const mjModel* m) {
  std::vector<ActuatorPart> out;
  out.reserve(actuator_count(m));
  for (int i = 0; i < actuator_count(m); ++i) out.push_back(part_of_actuator(m, i));
  return out;
}

MovingParts parts_of(mjSpec* spec) {
  MovingParts out = {.equalities = {},
                     .actuators = actuator_parts(spec),
                     .tendons = tendon_parts(spec),
                     .joints = {},
                     .gravcomp = {},
                     .flexes = count(spec, mjOBJ_FLEX),
                     .has_drag = spec->option.density != 0 || spec->option.viscosity != 0};
  for (mjsElement* e : elements(spec, mjOBJ_EQUALITY))
    if (const mjsEquality* equality = mjs_asEquality(e); equality->active)
      out.equalities.push_back(equality->type);
  for (mjsElement* e : elements(spec, mjOBJ_JOINT))
    out.joints.push_back(part_of(spec, mjs_asJoint(e)));
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) out.gravcomp.push_back(mjs_asBody(e)->gravcomp);
  return out;
}

MovingParts parts_of(const mjModel* m) {
  MovingParts out = {.equalities = {},
                     .actuators = actuator_parts(m),
                     .tendons = tendon_parts(m),
                     .joints = {},
                     .gravcomp = {m->body_gravcomp, m->body_gravcomp + m->nbody},
                     .flexes = static_cast<int>(m->nflex),
                     .has_drag = m->opt.density != 0 || m->opt.viscosity != 0};
  for (int i = 0; i < m->neq; ++i)
    if (m->eq_active0[i]) out.equalities.push_back(m->eq_type[i]);
  for (int j = 0; j < m->njnt; ++j) out.joints.push_back(part_of_joint(m, j));
  return out;
}

void refuse_coupling_armature(const std::vector<ActuatorPart>& actuators,
                              const std::vector<TendonPart>& tendons, bool takes_steps) {
  for (const TendonPart& tendon : tendons) {
    if (tendon.armature == 0) continue;
    const std::string why = tendon.left_out();
    if (takes_steps && why.empty()) continue;
    throw InputError(
        "tendon '" + tendon.name + "' has armature " + std::to_string(tendon.armature) +
        ", which couples joints in M: " +
        (why.empty() ? "supported in implicit steps alone" : "not supported of a " + why));
  }
  for (const ActuatorPart& actuator : actuators) {
    if (takes_steps && actuator.drives_row()) continue;
    if (actuator.armature != 0 && actuator.transmission != mjTRN_JOINT)
      throw InputError("actuator '" + actuator.name + "' has armature " +
                       std::to_string(actuator.armature) +
                       " but does not drive a joint: not supported");
  }
}

}  // namespace kalmarm
