#include "robots/loader/tendons.hpp"

#include <cmath>
#include <string>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/parts.hpp"

namespace kalmarm {
void strip(mjsTendon* t) {
  t->limited = t->actfrclimited = mjLIMITED_FALSE;
  t->range[0] = t->range[1] = 0;
  t->frictionloss = 0;
  mjs_setString(t->material, "");
}

std::vector<int> rows_of_tendons(const mjModel* m) {
  std::vector<int> out;
  int rows = 0;
  for (const TendonPart& tendon : tendon_parts(m)) out.push_back(tendon.is_row() ? rows++ : -1);
  return out;
}

void check_tendons(const mjModel* m) {
  const std::vector<CoupledRow> rows = tendon_rows(m);
  const std::vector<int> numbers = rows_of_tendons(m);
  for (int t = 0; t < m->ntendon; ++t) {
    if (numbers[t] < 0) continue;
    const CoupledRow& row = rows[numbers[t]];
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
  const std::vector<int> numbers = rows_of_tendons(m);
  std::vector<CoupledRow> out;
  for (int t = 0; t < m->ntendon; ++t) {
    if (numbers[t] < 0) continue;
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
