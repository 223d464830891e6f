// Simulations of a motion (motion.hpp), each with its time.
//
// Fixed steps of h, with a(q, v, t) the acceleration of (1) of motion.hpp:
//   semi_implicit_euler  v+ = v + h a(q, v, t),  q+ = q (+) h v+                               (1)
//   rk4                  Runge and Kutta's classical method of order 4, for (u; v) of (3) of
//                        motion.hpp about the step's q: a quaternion stays on its sphere       (2)
//   springs_at_start     kalmarm::ImplicitStep, tau(t)                                         (3)
//   springs_at_end       likewise, with tau(t + h): the target where the springs are           (4)
//   mj_euler, mj_implicitfast, mj_rk4   mj_step of MuJoCo, tau(t), in mj_rk4 of every stage
//   mj_discrete          likewise, tau(t + h)
// Tolerances of a step, relative and absolute, with q' in the four numbers of a quaternion:
//   dopri5               Dormand and Prince's pair of orders 5 and 4, Boost.odeint
//   cvode_bdf            CVODE of SUNDIALS: backward differences of order 1 to 5, its Newton
//                        iteration with a dense Jacobian by differences
// The accelerations of (1), (2), dopri5 and cvode_bdf are those of kalmarm::Dynamics.
//
// Time is that of the stepping alone, from q, v at 0 to q, v at T, with what a step needs made before:
// the processor's for this thread, which is wall time where nobody else has the core.
#pragma once

#include <string>
#include <vector>

#include "accuracy/motion/motion.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm::motion {

enum class Status {
  ok,
  unstable,  // not finite, refused by the kernel, or off by more than itself (judged)
  given_up,  // an adaptive method that asked for more than `cap` calls
};

const char* to_string(Status status);

struct Integrator {
  std::string name;
  bool adaptive;   // by tolerances, else by steps
  bool of_mujoco;  // float64 alone, without our dynamics
  bool float32;    // whether it has that precision
};

// All that this build has, as they are listed above.
const std::vector<Integrator>& integrators();

// Whether SUNDIALS was found (scripts/setup --sundials).
bool has_cvode();

struct Method {
  std::string integrator;
  bool float32 = false;
  bool last_bits = false;  // of its dynamics
  double step = 0;         // h [s], or the tolerance
};

// What its dynamics are asked for.
inline DynamicsOptions dynamics_of(const Method& method) {
  return {.tolerance = method.last_bits ? std::optional(last_bits) : std::nullopt};
}

struct Effort {
  int repetitions = 5;    // at least, where a run is shorter than `long_run`
  double least = 0.01;    // of all repetitions [s]
  double long_run = 0.5;  // beyond which one run is enough [s]
  long cap = 500'000;     // calls of an adaptive method
};

struct Simulation {
  Status status = Status::ok;
  VectorX<long double> q = {}, v = {};  // at T; only where it is ok
  long steps = 0;                       // that were taken
  long calls = 0;                       // of an acceleration
  double seconds = 0;                   // median of the repetitions; NaN where it is not ok
};

// Throws InputError where h does not divide the duration, and where the method cannot be had.
Simulation simulate(const Motion& motion, const Method& method, const Effort& effort = {});

// Unstable where e_q > 1 or e_v > 1.
Status judged(Status status, const Errors& errors);

}  // namespace kalmarm::motion
