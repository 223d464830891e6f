#include "robots/loader/imposed_rows.hpp"

#include <algorithm>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_spec.hpp"

namespace kalmarm {
namespace {

// Joint of the compiled model; -1 for none.
int joint_called(const mjModel* m, const std::string& name) {
  return mj_name2id(m, mjOBJ_JOINT, name.c_str());
}

bool is_single(const mjModel* m, int joint) {
  return joint >= 0 && (m->jnt_type[joint] == mjJNT_HINGE || m->jnt_type[joint] == mjJNT_SLIDE);
}

[[noreturn]] void refuse(const std::string& joint, const std::string& why) {
  throw InputError("the coupling of joint '" + joint + "' " + why);
}

}  // namespace

std::vector<NamedCoupling> linear_couplings(mjSpec* spec) {
  std::vector<NamedCoupling> out;
  for (mjsElement* e : elements(spec, mjOBJ_EQUALITY)) {
    const mjsEquality* coupling = mjs_asEquality(e);
    if (coupling->type != mjEQ_JOINT || !coupling->active) continue;
    const std::string joint = mjs_getString(coupling->name1);
    if (std::any_of(coupling->data + 2, coupling->data + 5, [](double c) { return c != 0; }))
      refuse(joint, "is not linear: it cannot be imposed");
    out.push_back({joint, mjs_getString(coupling->name2), coupling->data[0], coupling->data[1]});
  }
  return out;
}

std::vector<DofCoupling> couplings_of(const mjModel* m,
                                      const std::vector<NamedCoupling>& couplings) {
  std::vector<DofCoupling> out;
  for (const auto& [joint, to, c0, c1] : couplings) {
    const int i = joint_called(m, joint), j = to.empty() ? -1 : joint_called(m, to);
    if (!to.empty() && j < 0) refuse(joint, "is to '" + to + "', which is not there");
    if (!is_single(m, i) || (j >= 0 && !is_single(m, j)))
      refuse(joint, "is not of hinges and slides");
    const int dof = m->jnt_dofadr[i], of = j < 0 ? -1 : m->jnt_dofadr[j];
    if (of == dof) refuse(joint, "is to itself");
    const double ratio = j < 0 ? 0 : c1;
    const double q0 = m->qpos0[m->jnt_qposadr[i]], p0 = j < 0 ? 0 : m->qpos0[m->jnt_qposadr[j]];
    out.push_back({dof, of, q0 + c0 - ratio * p0, ratio});
  }
  return out;
}

std::vector<CoupledRow> imposed_rows(int nv, const std::vector<DofCoupling>& couplings) {
  std::vector<CoupledRow> out;
  for (const auto& [dof, of, offset, ratio] : couplings) {
    CoupledRow row = {.jacobian = std::vector<double>(nv, 0), .reference = offset, .imposed = true};
    row.jacobian[dof] = 1;
    if (of >= 0) row.jacobian[of] = -ratio;
    out.push_back(std::move(row));
  }
  return out;
}

}  // namespace kalmarm
