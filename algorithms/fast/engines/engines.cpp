#include "algorithms/fast/engines/engines.hpp"

#include "algorithms/fast/ladder/narrow_engine.hpp"

namespace kalmarm {
namespace {

std::unique_ptr<Engine<double>> make_double(const RobotModel& robot, const EngineOptions& options) {
  const bool refined = options.tolerance < least_tolerance_of_double;
  if (options.kernel == Kernel::translational && !refined)
    return make_translational_engine(robot, options);
  return make_spatial_engine(robot, options);
}

std::unique_ptr<Engine<float>> make_float(const RobotModel& robot, const EngineOptions& options) {
  if (options.kernel == Kernel::spatial_at_rest)
    return std::make_unique<NarrowEngine<AtRest>>(robot, options, make_double);
  return std::make_unique<NarrowEngine<CovarianceForm>>(robot, options, make_double);
}

}  // namespace
}  // namespace kalmarm

extern "C" const kalmarm::Engines KALMARM_ENGINES{kalmarm::make_float,
                                                  kalmarm::make_double,
                                                  kalmarm::make_engine_of_kinematics<float>,
                                                  kalmarm::make_engine_of_kinematics<double>,
                                                  kalmarm::make_engine_of_gradients<float>,
                                                  kalmarm::make_engine_of_gradients<double>,
                                                  kalmarm::make_check_engine};
