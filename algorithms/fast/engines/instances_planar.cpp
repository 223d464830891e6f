#include "algorithms/fast/engines/engines.hpp"
#include "algorithms/fast/planar/planar_engine.hpp"
#include "algorithms/fast/planar/translational_engine.hpp"

namespace kalmarm {

template <class T>
std::unique_ptr<Engine<T>> make_planar_engine(const RobotModel& robot,
                                              const EngineOptions& options) {
  return std::make_unique<PlanarEngine<T>>(robot, options);
}

template <class T>
std::unique_ptr<Engine<T>> make_translational_engine(const RobotModel& robot,
                                                     const EngineOptions& options) {
  return std::make_unique<TranslationalEngine<T>>(robot, options);
}

KALMARM_PLANAR_INSTANCES(, float)
KALMARM_PLANAR_INSTANCES(, double)

}  // namespace kalmarm
