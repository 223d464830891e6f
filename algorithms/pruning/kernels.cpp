// Instantiates the fast path's solvers of a plan's parts, but for the one in the registry.
#include "algorithms/planar/planar_solver.hpp"
#include "algorithms/planar/translational_solver.hpp"
#include "algorithms/pruning/answer.hpp"
#include "algorithms/structured/at_rest.hpp"
#include "algorithms/structured/structured_solver.hpp"

namespace kalmarm {

template <class T>
std::unique_ptr<Solver<T>> make_structured_kernel(Kernel kernel, const Model<T>& model) {
  switch (kernel) {
    case Kernel::spatial:
      return make_solver<T>("Structured", model);
    case Kernel::spatial_at_rest:
      return std::make_unique<StructuredSolver<T, AtRest>>(model);
    case Kernel::planar:
      return std::make_unique<PlanarSolver<T>>(model);
    case Kernel::translational:
      return std::make_unique<TranslationalSolver<T>>(model);
  }
  return nullptr;
}

template std::unique_ptr<Solver<float>> make_structured_kernel(Kernel, const Model<float>&);
template std::unique_ptr<Solver<double>> make_structured_kernel(Kernel, const Model<double>&);

}  // namespace kalmarm
