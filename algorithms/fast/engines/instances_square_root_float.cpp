#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_SQUARE_ROOT_INSTANCES(, float, float)
KALMARM_SQUARE_ROOT_INSTANCES(, float, StateLanes<float>)
KALMARM_SQUARE_ROOT_FACTOR_INSTANCES(, float)

}  // namespace kalmarm
