// SUNDIALS was not found: scripts/setup --sundials installs it.
#include "accuracy/motion/cvode.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::motion {

bool has_cvode() { return false; }

Simulation by_cvode(const Motion&, const Method&, const Effort&) {
  throw InputError("integrator 'cvode_bdf' needs SUNDIALS: scripts/setup --sundials");
}

}  // namespace kalmarm::motion
