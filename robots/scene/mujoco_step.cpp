#include "robots/scene/mujoco_step.hpp"

#include <algorithm>

#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/tendons.hpp"

namespace kalmarm {
namespace {

// What a file that nobody stripped may have beside the terms of ImplicitStep.
void strip_forces(mjModel* m) {
  const auto zero = [](auto* numbers, std::ptrdiff_t count) { std::fill_n(numbers, count, 0); };
  const std::ptrdiff_t joints = m->njnt, tendons = m->ntendon, actuators = actuator_count(m);
  zero(m->jnt_actfrclimited, joints);
  zero(m->jnt_actgravcomp, joints);  // without an actuator MuJoCo would leave it out
  zero(m->jnt_stiffnesspoly, joints * mjNPOLY);
  zero(m->dof_dampingpoly, static_cast<std::ptrdiff_t>(m->nv) * mjNPOLY);
  zero(m->actuator_forcelimited, actuators);
  zero(m->actuator_dampingpoly, actuators * mjNPOLY);
  zero(m->tendon_actfrclimited, tendons);
  zero(m->tendon_stiffnesspoly, tendons * mjNPOLY);
  zero(m->tendon_dampingpoly, tendons * mjNPOLY);
  const std::vector<int> rows = rows_of_tendons(m);
  for (std::ptrdiff_t t = 0; t < tendons; ++t)
    if (rows[t] < 0) m->tendon_stiffness[t] = m->tendon_damping[t] = m->tendon_armature[t] = 0;
  for (std::ptrdiff_t i = 0; i < actuators; ++i)
    if (m->actuator_trntype[i] == mjTRN_TENDON && rows[m->actuator_trnid[2 * i]] < 0)
      m->actuator_damping[i] = m->actuator_armature[i] = 0;
}

mjtIntegrator mujoco_integrator(Integrator integrator) {
  switch (integrator) {
    case Integrator::euler:
      return mjINT_EULER;
    case Integrator::implicitfast:
      return mjINT_IMPLICITFAST;
    default:
      return mjINT_DISCRETE;
  }
}

}  // namespace

std::vector<bool> lone_free_dofs(const Model<double>& model) {
  constexpr int dofs = 6;
  std::vector<bool> out(model.nv(), false);
  for (int first = 0; first < model.nv(); ++first) {
    if (model.joint(first).coordinate != Coordinate::position || model.parent(first) >= 0) continue;
    bool alone = true;
    for (int k = first + dofs; k < model.nv(); ++k)
      alone = alone && model.parent(k) != first + dofs - 1;
    std::fill_n(out.begin() + first, dofs, alone);
  }
  return out;
}

std::string left_out_of_rows(const Model<double>& model, const std::vector<CoupledRow>& rows,
                             Integrator integrator) {
  const auto carries = [&](int i, int k) {
    while (k > i) k = model.parent(k);
    return k == i;
  };
  const auto spans_branches = [&](const CoupledRow& row) {
    for (int k = 0; k < model.nv(); ++k)
      for (int i = 0; i < k; ++i)
        if (row.jacobian[i] != 0 && row.jacobian[k] != 0 && !carries(i, k)) return true;
    return false;
  };
  for (const CoupledRow& row : rows) {
    if (!spans_branches(row)) continue;
    if (row.armature > 0) return "a tendon's armature between joints of different branches";
    if (row.damping > 0 && integrator == Integrator::implicitfast)
      return "a tendon's damping between joints of different branches";
  }
  return "";
}

MujocoStep::MujocoStep(const MujocoModel& model, double h, const JointTerms& joints,
                       Integrator integrator)
    : MujocoStep(model, h, joints, mujoco_integrator(integrator), true) {}

MujocoStep::MujocoStep(const MujocoModel& model, double h, const JointTerms& joints,
                       mjtIntegrator integrator)
    : MujocoStep(model, h, joints, integrator, false) {}

MujocoStep::MujocoStep(const MujocoModel& model, double h, const JointTerms& joints,
                       mjtIntegrator integrator, bool forces_of_file)
    : model_(mj_copyModel(nullptr, model.get()), mj_deleteModel),
      data_(mj_makeData(model_.get()), mj_deleteData),
      controls_(model.controls()) {
  mjModel* const m = model_.get();
  strip_forces(m);
  m->opt.timestep = h;
  m->opt.integrator = integrator;
  if (!forces_of_file) {
    m->opt.disableflags |= mjDSBL_ACTUATION;
    m->opt.disableflags &= ~mjDSBL_EULERDAMP;
  }
  // Beside tendons `discrete` solves by iterations, which a file may cut short.
  m->opt.solver = mjSOL_NEWTON;
  m->opt.iterations = 1000;
  m->opt.tolerance = 1e-15;
  // Springs at the start of a step give accelerations above 1e10, at which MuJoCo starts anew.
  m->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_CONSTRAINT | mjDSBL_AUTORESET;
  m->opt.disableflags &= ~(mjDSBL_SPRING | mjDSBL_DAMPER);
  m->opt.enableflags = 0;
  m->opt.density = m->opt.viscosity = 0;
  const bool compensates = forces_of_file && model.compensated().has_value();
  for (int i = 0; i < m->nbody; ++i)
    m->body_gravcomp[i] = compensates ? std::max(m->body_gravcomp[i], 0.0) : 0;
  // The model's own flags have been heeded where its terms were read.
  const bool springs = (model.get()->opt.disableflags & mjDSBL_SPRING) == 0,
             damps = (model.get()->opt.disableflags & mjDSBL_DAMPER) == 0;
  if (!forces_of_file || !springs) std::fill_n(m->tendon_stiffness, m->ntendon, 0.0);
  if (!forces_of_file || !damps) std::fill_n(m->tendon_damping, m->ntendon, 0.0);
  if (!forces_of_file) std::fill_n(m->tendon_armature, m->ntendon, 0.0);
  for (int i = 0; i < m->nactuator; ++i) {
    const bool on_tendon = m->actuator_trntype[i] == mjTRN_TENDON;
    if (!on_tendon || !forces_of_file || !damps) m->actuator_damping[i] = 0;
    if (on_tendon && !forces_of_file) m->actuator_armature[i] = 0;
  }
  std::fill_n(m->dof_damping, m->nv, 0.0);
  std::fill_n(m->jnt_stiffness, m->njnt, 0.0);
  std::copy(joints.damping.begin(), joints.damping.end(), m->dof_damping);
  for (int j = 0; j < m->njnt; ++j) {
    const int dof = m->jnt_dofadr[j];
    if (!joints.stiffness.empty()) m->jnt_stiffness[j] = joints.stiffness[dof];
    if (!joints.reference.empty() && m->jnt_stiffness[j] > 0)
      m->qpos_spring[m->jnt_qposadr[j]] = joints.reference[dof];
  }
  std::copy(controls_.begin(), controls_.end(), data_->ctrl);
}

void MujocoStep::set(const VectorX<double>& q, const VectorX<double>& v,
                     const VectorX<double>& tau) {
  std::copy(q.begin(), q.end(), data_->qpos);
  std::copy(v.begin(), v.end(), data_->qvel);
  std::copy(tau.begin(), tau.end(), data_->qfrc_applied);
}

void MujocoStep::step(const VectorX<double>& q, const VectorX<double>& v,
                      const VectorX<double>& tau) {
  set(q, v, tau);
  mj_step(model_.get(), data_.get());
}

void MujocoStep::start(const VectorX<double>& q, const VectorX<double>& v) {
  mj_resetData(model_.get(), data_.get());
  std::copy(controls_.begin(), controls_.end(), data_->ctrl);
  std::copy(q.begin(), q.end(), data_->qpos);
  std::copy(v.begin(), v.end(), data_->qvel);
}

void MujocoStep::go_on(const VectorX<double>& tau) {
  std::copy(tau.begin(), tau.end(), data_->qfrc_applied);
  mj_step(model_.get(), data_.get());
}

void MujocoStep::forward(const VectorX<double>& q, const VectorX<double>& v,
                         const VectorX<double>& tau) {
  set(q, v, tau);
  mj_forward(model_.get(), data_.get());
}

}  // namespace kalmarm
