// Equality constraints of a compiled model as those of kalmarm/constraint.hpp: connect, weld and joint. Of a row
//   k = 1 / (d1 t z)^2,  b = 2 / (d1 t)      solref = (t, z), solimp = (d0, d1, …); negative: k = -solref[0] / d1^2, b = -solref[1] / d1
//   R = w (1 - d) / d                        w: the sum of the inverse weights of what it holds (body_invweight0, dof_invweight0)
// with t at least two steps of the file's option timestep, unless refsafe is off.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

#include "kalmarm/load.hpp"

namespace kalmarm {

class MujocoModel;

// Of an equality's type, whether who asks takes it as a constraint.
inline bool is_taken(int equality, const LoadOptions& options) {
  return options.takes_constraints && (equality == mjEQ_CONNECT || equality == mjEQ_WELD ||
                                       (equality == mjEQ_JOINT && !options.imposes_couplings));
}

// Which constraints of the robot are open where its file starts, by name with their distance |e|; "" where all are closed.
std::string open_at_home(const MujocoModel& model, const LoadedRobot& robot);

// Inverse weights anew, where the compiler had other inertias.
void weigh_constraints(mjModel* model);

}  // namespace kalmarm
