// mj_step as a reference for implicit steps (kalmarm/implicit_step.hpp): a robot's springs, dampers, fixed
// tendons, actuators and compensation of gravity, without contacts, limits, constraints and fluids; to
// the last digit, whatever solver and tolerance the file names.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/model.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/loader/mujoco_model.hpp"
#include "robots/scene/step_terms.hpp"

namespace kalmarm {

// DoF of free joints that carry no other joint. By implicitfast and discrete MuJoCo takes the gyroscopic
// torque of such a body at the end of a step, by its derivative in M^: their a is not that of
// ImplicitStep, by some 1e-5 at h = 2 ms and 1 rad/s.
std::vector<bool> lone_free_dofs(const Model<double>& model);

// What of the rows of tendons MuJoCo leaves out by an integrator; "" where it solves the equation of
// ImplicitStep. Its M holds no entries between joints of different branches, which a tendon's armature
// would have; implicitfast keeps to the same entries with damping, discrete does not.
std::string left_out_of_rows(const Model<double>& model, const std::vector<CoupledRow>& rows,
                             Integrator integrator);

static_assert(mjVERSION_HEADER >= 3013000, "MuJoCo's discrete integrator: run scripts/setup");

class MujocoStep {
 public:
  // The terms take the place of those of the model's joints; tendons are the model's.
  MujocoStep(const MujocoModel& model, double h, const JointTerms& joints, Integrator integrator);

  // Without the file's tendons, actuators and compensation of gravity, by any integrator of MuJoCo.
  MujocoStep(const MujocoModel& model, double h, const JointTerms& joints,
             mjtIntegrator integrator);

  // From q (nq), v (nv) and tau (nv) to q() and v() after h.
  void step(const VectorX<double>& q, const VectorX<double>& v, const VectorX<double>& tau);

  // From q and v at time 0 through step after step of q() and v() under tau.
  void start(const VectorX<double>& q, const VectorX<double>& v);
  void go_on(const VectorX<double>& tau);

  // mj_forward: what a step does before it integrates.
  void forward(const VectorX<double>& q, const VectorX<double>& v, const VectorX<double>& tau);

  Eigen::Map<const VectorX<double>> q() const { return {data_->qpos, model_->nq}; }
  Eigen::Map<const VectorX<double>> v() const { return {data_->qvel, model_->nv}; }

 private:
  void set(const VectorX<double>& q, const VectorX<double>& v, const VectorX<double>& tau);

  MujocoStep(const MujocoModel& model, double h, const JointTerms& joints, mjtIntegrator integrator,
             bool forces_of_file);

  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
  VectorX<double> controls_;
};

}  // namespace kalmarm
