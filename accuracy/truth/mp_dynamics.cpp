// Dynamics in multi-precision: by the variants of the study, which are its engines.
#include "accuracy/measures/real.hpp"
#include "algorithms/dynamics/dynamics_members.hpp"

namespace kalmarm {

template class Dynamics<Real>;

}  // namespace kalmarm
