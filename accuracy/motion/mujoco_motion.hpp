// mj_step through a whole motion, without contacts, limits and constraints (mujoco_step.hpp).
#pragma once

#include "accuracy/motion/simulate.hpp"

namespace kalmarm::motion {

// method.integrator: mj_euler, mj_implicitfast, mj_discrete or mj_rk4. mj_step holds the applied
// forces over a step. For mj_rk4 MuJoCo's callback of passive forces gives tau(t) of every stage; it is
// one a process, so that two threads must not be in here.
Simulation by_mujoco(const Motion& motion, const Method& method, const Effort& effort);

}  // namespace kalmarm::motion
