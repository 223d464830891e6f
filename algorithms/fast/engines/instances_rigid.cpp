#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_LOWERING_INSTANCES(, float)
KALMARM_LOWERING_INSTANCES(, double)
KALMARM_RIGID_INSTANCES(, float, StateLanes<float>)
KALMARM_RIGID_INSTANCES(, double, double)
KALMARM_RIGID_INSTANCES(, double, StateLanes<double>)
KALMARM_MASS_INSTANCES(, double)

}  // namespace kalmarm
