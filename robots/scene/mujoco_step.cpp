#include "robots/scene/mujoco_step.hpp"

#include <algorithm>

namespace kalmarm {

MujocoStep::MujocoStep(const MujocoModel& model, double h, const JointTerms& terms,
                       mjtIntegrator integrator)
    : model_(mj_copyModel(nullptr, model.get()), mj_deleteModel),
      data_(mj_makeData(model_.get()), mj_deleteData) {
  mjModel* const m = model_.get();
  m->opt.timestep = h;
  m->opt.integrator = integrator;
  // Springs at the start of a step give accelerations above 1e10, at which MuJoCo starts anew.
  m->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_CONSTRAINT | mjDSBL_ACTUATION | mjDSBL_AUTORESET;
  m->opt.density = m->opt.viscosity = 0;
  std::fill_n(m->body_gravcomp, m->nbody, 0.0);
  std::fill_n(m->tendon_stiffness, m->ntendon, 0.0);
  std::fill_n(m->tendon_damping, m->ntendon, 0.0);
  std::fill_n(m->dof_damping, m->nv, 0.0);
  std::fill_n(m->jnt_stiffness, m->njnt, 0.0);
  std::copy(terms.damping.begin(), terms.damping.end(), m->dof_damping);
  for (int j = 0; j < m->njnt; ++j) {
    const int dof = m->jnt_dofadr[j];
    if (!terms.stiffness.empty()) m->jnt_stiffness[j] = terms.stiffness[dof];
    if (!terms.reference.empty() && m->jnt_stiffness[j] > 0)
      m->qpos_spring[m->jnt_qposadr[j]] = terms.reference[dof];
  }
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
