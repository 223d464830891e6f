#include "algorithms/fast/engines/engines.hpp"
#include "algorithms/fast/engines/spatial_engine.hpp"

namespace kalmarm {

std::unique_ptr<Engine<double>> make_spatial_engine(const RobotModel& robot,
                                                    const EngineOptions& options) {
  if (options.kernel == Kernel::spatial_at_rest)
    return std::make_unique<SpatialEngine<AtRest>>(robot, options);
  return std::make_unique<SpatialEngine<CovarianceForm>>(robot, options);
}

}  // namespace kalmarm
