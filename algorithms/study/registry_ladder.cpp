// The fast path as variants of the registry: one Dynamics behind the interface of the study, so
// that programs, benchmarks and tests judge it like any other.
#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {
namespace {

template <class T>
class FastSolver final : public Solver<T> {
 public:
  FastSolver(const Model<T>& model, std::optional<double> tolerance)
      : dynamics_(
            plain(model.template cast<double>()),
            {.tolerance = tolerance,
             .question = {.want = {Want::acceleration, Want::solve, Want::inverse, Want::mass}}}) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    return dynamics_.forward_dynamics(q, qd, tau, a);
  }
  Outcome factor(const VectorX<T>& q) override { return dynamics_.factor(q); }
  void solve(const VectorX<T>& tau, VectorX<T>& x) override {
    (void)dynamics_.solve(VectorView<const T>(tau), VectorView<T>(x));
  }
  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    return dynamics_.inverse_mass(q, X);
  }
  void mass(const VectorX<T>& q, MatrixX<T>& M) override { dynamics_.mass(q, M); }

 private:
  Dynamics<T> dynamics_;
};

template <class T>
RegisteredVariant<T> variant(std::optional<double> tolerance, const char* name,
                             const char* equation) {
  return {name,
          equation,
          {.kind = VariantKind::ladder,
           .tolerance = tolerance,
           .wants = {Want::acceleration, Want::solve, Want::inverse, Want::mass},
           .citation = "Rodriguez 1987; frames after Denavit and Hartenberg"},
          [tolerance](const Model<T>& model) {
            return std::unique_ptr<Solver<T>>(std::make_unique<FastSolver<T>>(model, tolerance));
          }};
}

}  // namespace

template <class T>
std::vector<RegisteredVariant<T>> ladder_variants() {
  return {variant<T>({}, "Ladder<default>",
                     "(3.6), (4.1) to (4.11), written out for frames on the axes"),
          variant<T>(last_bits, "Ladder<last_bits>",
                     "the same, refined by residuals in twice the precision")};
}

template std::vector<RegisteredVariant<float>> ladder_variants<float>();
template std::vector<RegisteredVariant<double>> ladder_variants<double>();

}  // namespace kalmarm
