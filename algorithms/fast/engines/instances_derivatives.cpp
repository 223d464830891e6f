#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_DERIVATIVE_INSTANCES(, double)
KALMARM_DERIVATIVE_ROW_INSTANCES(, StateLanes<float>)
KALMARM_DERIVATIVE_ROW_INSTANCES(, StateLanes<double>)

}  // namespace kalmarm
