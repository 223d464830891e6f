#include "algorithms/fast/certified/certified_engine.hpp"
#include "algorithms/fast/engines/engines.hpp"

namespace kalmarm {

std::unique_ptr<Engine<double>> make_certified_engine(const RobotModel& robot,
                                                      const EngineOptions& options) {
  return std::make_unique<CertifiedEngine>(robot, options);
}

}  // namespace kalmarm
