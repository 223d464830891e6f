#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_ROW_INSTANCES(, float, StateLanes<float>)
KALMARM_ROW_INSTANCES(, double, StateLanes<double>)

}  // namespace kalmarm
