#include "algorithms/solver.hpp"
#include "algorithms/structured/structured_solver.hpp"

namespace kalmarm {
namespace {

constexpr const char* conventional = "(3.6), (4.1) to (4.11), written out for frames on the axes";
constexpr const char* square_root = "the same in square roots: rows of Gauss' principle";

template <class T, class Form>
RegisteredVariant<T> variant(const char* name, const char* equation) {
  return {name, equation, true, [](const Model<T>& model) {
            return std::unique_ptr<Solver<T>>(std::make_unique<StructuredSolver<T, Form>>(model));
          }};
}

}  // namespace

template class StructuredSolver<float, CovarianceForm>;
template class StructuredSolver<double, CovarianceForm>;

template <class T>
std::vector<RegisteredVariant<T>> structured_variants() {
  return {variant<T, CovarianceForm>("Structured", conventional),
          variant<T, SquareRootForm>("StructuredSquareRoot", square_root)};
}

template std::vector<RegisteredVariant<float>> structured_variants<float>();
template std::vector<RegisteredVariant<double>> structured_variants<double>();

}  // namespace kalmarm
