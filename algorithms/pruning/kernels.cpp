// Instantiates the fast path's solvers of a plan's parts.
#include "algorithms/planar/planar_solver.hpp"
#include "algorithms/planar/translational_solver.hpp"
#include "algorithms/pruning/answer.hpp"
#include "algorithms/structured/at_rest.hpp"
#include "algorithms/structured/structured_solver.hpp"

namespace kalmarm {

extern template class StructuredSolver<float, CovarianceForm>;  // registry_structured.cpp
extern template class StructuredSolver<double, CovarianceForm>;

template <class T>
std::unique_ptr<Solver<T>> make_structured_kernel(const Part& part, const Model<T>& model) {
  switch (part.kernel) {
    case Kernel::spatial:
      return std::make_unique<StructuredSolver<T, CovarianceForm>>(model, part.zeros);
    case Kernel::spatial_at_rest:
      return std::make_unique<StructuredSolver<T, AtRest>>(model, part.zeros);
    case Kernel::planar:
      return std::make_unique<PlanarSolver<T>>(model);
    case Kernel::translational:
      return std::make_unique<TranslationalSolver<T>>(model);
  }
  return nullptr;
}

template std::unique_ptr<Solver<float>> make_structured_kernel(const Part&, const Model<float>&);
template std::unique_ptr<Solver<double>> make_structured_kernel(const Part&, const Model<double>&);

}  // namespace kalmarm
