#include "robots/loader/tendons.hpp"

#include <algorithm>
#include <cmath>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"

namespace kalmarm {
namespace {

bool is_fixed(const mjsTendon* tendon) {
  const int count = mjs_getWrapNum(tendon);
  for (int i = 0; i < count; ++i)
    if (mjs_getWrap(tendon, i)->type != mjWRAP_JOINT) return false;
  return count > 0;
}

// Releases before 3.13 have none.
template <class Tendon>
double yield_of(const Tendon& tendon) {
  if constexpr (requires { tendon.springyield; })
    return tendon.springyield;
  else
    return 0;
}

}  // namespace

std::string left_out(const mjsTendon* t) {
  if (!is_fixed(t)) return "spatial tendon";
  if (is_nonlinear(t->stiffness) || is_nonlinear(t->damping))
    return "tendon with nonlinear springs or damping";
  const double k = linear(t->stiffness);
  if (k < 0 || linear(t->damping) < 0) return "tendon with negative stiffness or damping";
  if (k > 0 && yield_of(*t) != 0) return "plastic tendon";
  const bool is_band = t->springlength[0] < t->springlength[1];
  return k > 0 && is_band ? "tendon with a dead band" : "";
}

bool has_force(const mjsTendon* t) {
  return linear(t->stiffness) != 0 || linear(t->damping) != 0 || t->armature != 0 ||
         is_nonlinear(t->stiffness) || is_nonlinear(t->damping);
}

bool is_driven(mjSpec* spec, const mjsTendon* t) {
  const std::string name = name_of(t->element);
  return std::ranges::any_of(elements(spec, mjOBJ_ACTUATOR), [&](mjsElement* e) {
    const mjsActuator* actuator = mjs_asActuator(e);
    return actuator->trntype == mjTRN_TENDON && mjs_getString(actuator->target) == name;
  });
}

void strip(mjsTendon* t) {
  t->limited = t->actfrclimited = mjLIMITED_FALSE;
  t->range[0] = t->range[1] = 0;
  t->frictionloss = 0;
  mjs_setString(t->material, "");
}

void check_tendons(const mjModel* m) {
  const std::vector<CoupledRow> rows = tendon_rows(m);
  for (int t = 0; t < m->ntendon; ++t) {
    const CoupledRow& row = rows[t];
    double sum = row.armature + row.damping + row.stiffness + row.reference;
    for (const double J : row.jacobian) sum += J;
    if (std::isfinite(sum)) continue;
    const char* const name = mj_id2name(m, mjOBJ_TENDON, t);
    throw InputError("tendon '" + std::string(name ? name : "") + "': a number is not finite");
  }
}

std::vector<CoupledRow> tendon_rows(const mjModel* m) {
  const bool damps = (m->opt.disableflags & mjDSBL_DAMPER) == 0,
             springs = (m->opt.disableflags & mjDSBL_SPRING) == 0;
  std::vector<CoupledRow> out;
  for (int t = 0; t < m->ntendon; ++t) {
    CoupledRow row;
    row.jacobian.assign(m->nv, 0);
    for (int i = m->tendon_adr[t]; i < m->tendon_adr[t] + m->tendon_num[t]; ++i)
      row.jacobian[m->jnt_dofadr[m->wrap_objid[i]]] += m->wrap_prm[i];
    row.armature = m->tendon_armature[t];
    if (damps) row.damping = m->tendon_damping[t];
    if (springs) row.stiffness = m->tendon_stiffness[t];
    row.reference = m->tendon_lengthspring[2 * t];
    for (int i = 0; i < actuator_count(m); ++i) {
      if (m->actuator_trntype[i] != mjTRN_TENDON || m->actuator_trnid[2 * i] != t) continue;
      const double G = m->actuator_gear[6 * i];
      row.armature += G * G * m->actuator_armature[i];
      if (damps) row.damping += G * G * m->actuator_damping[i];
    }
    out.push_back(std::move(row));
  }
  return out;
}

}  // namespace kalmarm
