#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_DERIVATIVE_INSTANCES(, float)
KALMARM_DERIVATIVE_INSTANCES(, double)

}  // namespace kalmarm
