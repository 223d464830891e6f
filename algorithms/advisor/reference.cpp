#include "algorithms/advisor/reference.hpp"

#include <cmath>

#include "algorithms/inverse_mass/factored_bias.hpp"
#include "algorithms/inverse_mass/refinement/wide_refined.hpp"
#include "algorithms/riccati/array.hpp"
#include "algorithms/solver_of.hpp"

namespace kalmarm {
namespace {

class ReferenceSolver final : public Solver<double> {
 public:
  explicit ReferenceSolver(const Model<double>& model)
      : refined_(model),
        narrow_(model),
        wide_(model.cast<Wide>()),
        wide_X_(model.nv(), model.nv()) {}

  Outcome acceleration(const VectorX<double>& q, const VectorX<double>& qd,
                       const VectorX<double>& tau, VectorX<double>& a) override {
    Outcome out = refined_.acceleration(q, qd, tau, a);
    if (out.error > settled * unit_roundoff<double>()) out.error *= unsettled;  // (1)
    return out;
  }
  Outcome factor(const VectorX<double>& q) override { return refined_.factor(q); }
  void solve(const VectorX<double>& tau, VectorX<double>& x) override { refined_.solve(tau, x); }

  Outcome inverse(const VectorX<double>& q, MatrixX<double>& X) override {
    Outcome out = wide_.inverse(q.cast<Wide>(), wide_X_);
    if (!out) return out;
    const bool known = static_cast<bool>(narrow_.inverse(q, X));
    const double u = unit_roundoff<double>(), shrink = double(unit_roundoff<Wide>()) / u;
    out.error = u + same_variant * shrink * (known ? scaled_difference(X) : 1 / u);  // (2)
    X = wide_X_.cast<double>();
    return out;
  }

  void mass(const VectorX<double>& q, MatrixX<double>& M) override { refined_.mass(q, M); }

 private:
  using Wide = long double;
  static constexpr double settled = 8, unsettled = 100;
  static constexpr double same_variant = 10;  // errors in two precisions, over their u, differ less

  double scaled_difference(const MatrixX<double>& X) const {
    double worst = 0;
    for (Eigen::Index j = 0; j < X.cols(); ++j)
      for (Eigen::Index i = 0; i <= j; ++i) {
        const Wide scale = std::sqrt(wide_X_(i, i) * wide_X_(j, j));
        const auto error = static_cast<double>(std::abs(X(i, j) - wide_X_(i, j)) / scale);
        if (!(error <= worst)) worst = error;
      }
    return worst;
  }

  SolverOf<WideRefined<FactoredBias<ArrayGivens>>, double> refined_;
  SolverOf<FactoredBias<ArrayGivens>, double> narrow_;
  SolverOf<FactoredBias<ArrayGivens>, Wide> wide_;
  MatrixX<Wide> wide_X_;
};

}  // namespace

std::unique_ptr<Solver<double>> make_reference(const Model<double>& model) {
  return std::make_unique<ReferenceSolver>(model);
}

}  // namespace kalmarm
