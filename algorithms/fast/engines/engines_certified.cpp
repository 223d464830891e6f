#include "algorithms/fast/certified/certified_engine.hpp"
#include "algorithms/fast/engines/engines.hpp"

namespace kalmarm {

template <class T>
std::unique_ptr<Engine<T>> make_certified_engine(const RobotModel& robot,
                                                 const EngineOptions& options) {
  return std::make_unique<CertifiedEngine<T>>(robot, options);
}

KALMARM_CERTIFIED_INSTANCES(, float)
KALMARM_CERTIFIED_INSTANCES(, double)

}  // namespace kalmarm
