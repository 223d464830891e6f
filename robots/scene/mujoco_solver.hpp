// MuJoCo as a contender: its own smooth dynamics behind the Solver interface, float64.
//   M      mj_kinematics, mj_comPos, mj_makeM
//   M^-1   mj_factorM (L'DL, sparse over branches), mj_solveM on the unit vectors
//   a      mj_comVel, mj_rne for the bias (gravity, velocity terms), mj_solveM on tau - bias
//   tau    mj_kinematics, mj_comPos, mj_comVel, mj_rne with the acceleration; plus armature
// Neither contacts, limits, damping, springs, actuators nor constraints are called.
#pragma once

#include <memory>

#include "algorithms/study/solver.hpp"
#include "robots/loader/mujoco_model.hpp"

namespace kalmarm {

class MujocoSolver final : public Solver<double> {
 public:
  explicit MujocoSolver(std::shared_ptr<const MujocoModel> model);

  Outcome acceleration(const VectorX<double>& q, const VectorX<double>& qd,
                       const VectorX<double>& tau, VectorX<double>& a) override;
  Outcome factor(const VectorX<double>& q) override;
  void solve(const VectorX<double>& tau, VectorX<double>& x) override;
  Outcome inverse(const VectorX<double>& q, MatrixX<double>& X) override;

  // tau = M qdd + bias, armature included (nv values); qd and qdd have nv values.
  void inverse_dynamics(const VectorX<double>& q, const VectorX<double>& qd,
                        const VectorX<double>& qdd, VectorX<double>& tau);

  // M (nv x nv), both triangles.
  void mass(const VectorX<double>& q, MatrixX<double>& M) override;

 private:
  void make_position(const VectorX<double>& q);
  void make_mass(const VectorX<double>& q);
  void make_velocity(const VectorX<double>& qd);
  void make_bias(const VectorX<double>& qd);  // into rhs_, after make_mass

  std::shared_ptr<const MujocoModel> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
  MatrixX<double> identity_;
  VectorX<double> rhs_;
  VectorX<double> armature_;  // of joints, and of the actuators that drive them
};

// What it is among the variants of the registry.
VariantTraits mujoco_traits();

// Version of the MuJoCo library that is linked, such as "4.0.0".
const char* mujoco_version();

}  // namespace kalmarm
