// Linear couplings of joints of a file, equality constraints of joints in MJCF and <mimic> in URDF:
//   q_i - q0_i = c0 + c1 (q_j - q0_j)          q0: the joints' references; without j, c1 = 0      (1)
// As an imposed row of implicit steps (kalmarm/implicit_step.hpp) it is
//   J q = l0,  J = e_i - c1 e_j,  l0 = q0_i + c0 - c1 q0_j                                 (2)
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "kalmarm/implicit_step.hpp"

namespace kalmarm {

// As the file has it, by the names of its joints.
struct NamedCoupling {
  std::string joint, to;  // to: "" where the joint stands
  double c0, c1;
};

// Those that are active; ask it before strip(). Throws InputError with the joint where one is not linear.
std::vector<NamedCoupling> linear_couplings(mjSpec* spec);

// (1) as q_dof = offset + ratio q_of; of: -1 where the joint stands, ratio 0.
struct DofCoupling {
  int dof, of;
  double offset, ratio;
};

// In the compiled model. Throws InputError with the joint where one is not there, not a hinge or slide,
// or coupled to itself.
std::vector<DofCoupling> couplings_of(const mjModel* model,
                                      const std::vector<NamedCoupling>& couplings);

// (2)
std::vector<CoupledRow> imposed_rows(int nv, const std::vector<DofCoupling>& couplings);

}  // namespace kalmarm
