#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_FORWARD_INSTANCES(, float, StateLanes<float>)
KALMARM_FORWARD_INSTANCES(, double, double)
KALMARM_FORWARD_INSTANCES(, double, StateLanes<double>)
KALMARM_NOISY_INSTANCES(, float, StateLanes<float>)
KALMARM_NOISY_INSTANCES(, double, StateLanes<double>)

}  // namespace kalmarm
