// mj_step as a reference for implicit steps (kalmarm/implicit_step.hpp): a robot's springs and dampers,
// without contacts, limits, constraints, actuators, tendons' springs, fluids and compensation of gravity.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>

#include "algorithms/model/model.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/loader/mujoco_model.hpp"

namespace kalmarm {

static_assert(mjVERSION_HEADER >= 3013000, "MuJoCo's discrete integrator: run scripts/setup");

class MujocoStep {
 public:
  // The terms take the place of those of the model. integrator: mjINT_EULER, mjINT_IMPLICITFAST,
  // mjINT_DISCRETE or mjINT_RK4.
  MujocoStep(const MujocoModel& model, double h, const JointTerms& terms, mjtIntegrator integrator);

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

  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
};

}  // namespace kalmarm
