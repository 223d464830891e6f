#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_SQUARE_ROOT_INSTANCES(, double, double)
KALMARM_SQUARE_ROOT_INSTANCES(, double, StateLanes<double>)

}  // namespace kalmarm
