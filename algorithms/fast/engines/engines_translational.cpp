#include "algorithms/fast/engines/engines.hpp"
#include "algorithms/fast/translational/translational_state.hpp"

namespace kalmarm {

std::unique_ptr<Engine<double>> make_translational_engine(const RobotModel& robot,
                                                          const EngineOptions& options) {
  return std::make_unique<EngineInDouble<TranslationalState, AtRest>>(robot, options);
}

}  // namespace kalmarm
