#include "algorithms/fast/engines/engines.hpp"

#include "algorithms/fast/engines/spatial_engine.hpp"

namespace kalmarm {

KALMARM_PLANAR_INSTANCES(extern, float)
KALMARM_PLANAR_INSTANCES(extern, double)
KALMARM_CERTIFIED_INSTANCES(extern, float)
KALMARM_CERTIFIED_INSTANCES(extern, double)

namespace {

template <class T>
std::unique_ptr<Engine<T>> make(const RobotModel& robot, const EngineOptions& options) {
  if (options.form == Form::certified) return make_certified_engine<T>(robot, options);
  switch (options.kernel) {
    case Kernel::planar:
      return make_planar_engine<T>(robot, options);
    case Kernel::translational:
      return make_translational_engine<T>(robot, options);
    case Kernel::spatial_at_rest:
      return std::make_unique<SpatialEngine<T, AtRest>>(robot, options);
    case Kernel::spatial:
      break;
  }
  if (options.form == Form::square_root)
    return std::make_unique<SpatialEngine<T, SquareRootForm>>(robot, options);
  return std::make_unique<SpatialEngine<T, CovarianceForm>>(robot, options);
}

}  // namespace
}  // namespace kalmarm

extern "C" const kalmarm::Engines KALMARM_ENGINES{kalmarm::make<float>, kalmarm::make<double>};
