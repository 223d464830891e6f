// Fixed tendons of a file as rows of implicit steps (kalmarm/implicit_step.hpp).
//
// A fixed tendon has the length L = J q of hinges and slides. With its armature w, damping b, stiffness
// k and spring length l0 it is the row
//   M^ += J' (w + h b + h^2 k) J,  tau^ -= J' (b J v + k (J q - l0 + h J v))               (1)
// An actuator of gear G on it acts along l = G L, and is along L what one on a joint is along q
// ((1) of actuators.hpp): its spring and damper are added to the row's, its armature and its own
// damping times G^2. Left out are tendons whose length is not linear in q, and those whose force is
// not linear in their length: with a dead band, a plastic yield, nonlinear springs or dampers.
#pragma once

#include <mujoco/mujoco.h>

#include <vector>

#include "kalmarm/implicit_step.hpp"

namespace kalmarm {

// Leaves of a tendon what is a row; its limits, friction and looks are taken out.
void strip(mjsTendon* tendon);

// Throws InputError with the tendon of a compiled model where a number of its row is not finite.
void check_tendons(const mjModel* model);

// Of every tendon of a compiled model the number of its row; -1 of those that are none or move nothing.
std::vector<int> rows_of_tendons(const mjModel* model);

// (1), of the tendons that are rows, with what its actuators add by their attributes `armature` and
// `damping`.
std::vector<CoupledRow> tendon_rows(const mjModel* model);

}  // namespace kalmarm
