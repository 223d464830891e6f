// The square-root form as a variant of the registry, in a file of its own: its kernels are compiled
// here, for this machine alone.
#include "algorithms/study/square_root/square_root_solver.hpp"

namespace kalmarm {

template <class T>
RegisteredVariant<T> square_root_variant() {
  return {"AxisFrames<SquareRoot>",
          "(3.6), (4.1) to (4.11) in square roots: rows of Gauss' principle",
          {.kind = VariantKind::sequential,
           .citation = "Rodriguez 1987; fast Givens steps after Gentleman 1973"},
          [](const Model<T>& model) {
            return std::unique_ptr<Solver<T>>(std::make_unique<SquareRootSolver<T>>(model));
          }};
}

template RegisteredVariant<float> square_root_variant<float>();
template RegisteredVariant<double> square_root_variant<double>();

}  // namespace kalmarm
