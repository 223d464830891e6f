// Backward differences by CVODE of SUNDIALS: cvode.cpp where it was found, no_cvode.cpp where not.
#pragma once

#include "accuracy/motion/simulate.hpp"

namespace kalmarm::motion {

// In float64. Calls count those for differences of the Jacobian.
Simulation by_cvode(const Motion& motion, const Method& method, const Effort& effort);

}  // namespace kalmarm::motion
