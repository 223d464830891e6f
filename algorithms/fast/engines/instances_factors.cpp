#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_FACTOR_INSTANCES(, double)

}  // namespace kalmarm
