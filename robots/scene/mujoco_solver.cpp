#include "robots/scene/mujoco_solver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"

namespace kalmarm {

MujocoSolver::MujocoSolver(std::shared_ptr<const MujocoModel> model)
    : model_(std::move(model)), data_(nullptr, mj_deleteData) {
  install_mujoco_handlers();
  const mjModel* m = model_->get();
  data_.reset(mj_makeData(m));
  if (!data_) throw InputError("MuJoCo: no memory for mjData");
  identity_.setIdentity(m->nv, m->nv);
  rhs_.resize(m->nv);
  armature_.resize(m->nv);
  const Model<double> lowered = model_->lower();
  for (int k = 0; k < m->nv; ++k) armature_[k] = lowered.joint(k).r;
}

void MujocoSolver::make_position(const VectorX<double>& q) {
  std::copy(q.begin(), q.end(), data_->qpos);
  mj_kinematics(model_->get(), data_.get());
  mj_comPos(model_->get(), data_.get());
}

void MujocoSolver::make_mass(const VectorX<double>& q) {
  make_position(q);
  mj_makeM(model_->get(), data_.get());
}

void MujocoSolver::make_velocity(const VectorX<double>& qd) {
  std::copy(qd.begin(), qd.end(), data_->qvel);
  mj_comVel(model_->get(), data_.get());
}

void MujocoSolver::make_bias(const VectorX<double>& qd) {
  make_velocity(qd);
  mj_rne(model_->get(), data_.get(), 0, rhs_.data());
}

Outcome MujocoSolver::factor(const VectorX<double>& q) {
  const mjModel* m = model_->get();
  mjData* d = data_.get();
  d->warning[mjWARN_INERTIA].number = 0;
  make_mass(q);
  mj_factorM(m, d);
  // From 3.13 on MuJoCo clamps a pivot that is not positive, and counts a warning.
  const bool clamped = d->warning[mjWARN_INERTIA].number > 0;
  for (int k = 0; k < m->nv; ++k)
    if (!(d->qLDiagInv[k] > 0 && std::isfinite(d->qLDiagInv[k])) ||
        (clamped && k == d->warning[mjWARN_INERTIA].lastinfo))
      return {.status = Outcome::Status::indefinite, .joint = k, .D = 1 / d->qLDiagInv[k]};
  return {};
}

Outcome MujocoSolver::acceleration(const VectorX<double>& q, const VectorX<double>& qd,
                                   const VectorX<double>& tau, VectorX<double>& a) {
  const Outcome outcome = factor(q);
  if (!outcome) return outcome;
  make_bias(qd);
  rhs_ = tau - rhs_;
  solve(rhs_, a);
  return a.allFinite() ? outcome : Outcome{.status = Outcome::Status::not_finite};
}

void MujocoSolver::solve(const VectorX<double>& tau, VectorX<double>& x) {
  mj_solveM(model_->get(), data_.get(), x.data(), tau.data(), 1);
}

Outcome MujocoSolver::inverse(const VectorX<double>& q, MatrixX<double>& X) {
  const Outcome outcome = factor(q);
  if (!outcome) return outcome;
  mj_solveM(model_->get(), data_.get(), X.data(), identity_.data(), model_->get()->nv);
  return X.allFinite() ? outcome : Outcome{.status = Outcome::Status::not_finite};
}

void MujocoSolver::inverse_dynamics(const VectorX<double>& q, const VectorX<double>& qd,
                                    const VectorX<double>& qdd, VectorX<double>& tau) {
  const mjModel* m = model_->get();
  make_position(q);
  make_velocity(qd);
  std::copy(qdd.begin(), qdd.end(), data_->qacc);
  mj_rne(m, data_.get(), 1, tau.data());
  tau += armature_.cwiseProduct(qdd);  // mj_rne leaves it out
}

void MujocoSolver::mass(const VectorX<double>& q, MatrixX<double>& M) {
  make_mass(q);
  full_mass_matrix(model_->get(), data_.get(), M.data());  // symmetric: row- or column-major alike
}

VariantTraits mujoco_traits() {
  return {.kind = VariantKind::batch,
          .wants = {Want::acceleration, Want::solve, Want::inverse, Want::mass},
          .citation = "Todorov, Erez and Tassa 2012"};
}

const char* mujoco_version() { return mj_versionString(); }

}  // namespace kalmarm
