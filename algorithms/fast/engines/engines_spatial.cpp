#include "algorithms/fast/engines/engines.hpp"
#include "algorithms/fast/ladder/spatial_state.hpp"

namespace kalmarm {

std::unique_ptr<Engine<double>> make_spatial_engine(const RobotModel& robot,
                                                    const EngineOptions& options) {
  if (options.kernel == Kernel::spatial_at_rest)
    return std::make_unique<EngineInDouble<SpatialState<AtRest>, AtRest>>(robot, options);
  return std::make_unique<EngineInDouble<SpatialState<CovarianceForm>, CovarianceForm>>(robot,
                                                                                        options);
}

}  // namespace kalmarm
