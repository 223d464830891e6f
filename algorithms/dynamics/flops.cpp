#include "algorithms/dynamics/flops.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/fast/engine/flops.hpp"
#include "algorithms/fast/planar/planar_filter.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {
namespace {

constexpr double column = 43;  // a link and column of a sweep (columns.hpp)

// Links from k to the base.
int depth(const Model<double>& model, int k) {
  int out = 0;
  for (; k >= 0; k = model.parent(k)) ++out;
  return out;
}

double inverse_flops(const Model<double>& model) {
  // Links of a chain from which on M^-1 goes by tiles in float64 (inverse.hpp).
  constexpr int by_blocks = 6 * Lanes<TwoPacks<double>>::count;
  const double nv = model.nv();
  bool chain = model.nv() >= by_blocks;
  for (int k = 0; k < model.nv(); ++k) chain = chain && model.parent(k) == k - 1;
  if (chain) return 2300 * nv + 8 * nv * nv;
  double out = 0;
  for (int k = 0; k < model.nv(); ++k) out += column * (depth(model, k) + k + 1);
  return out;
}

// The position of the part in the question's.
VectorX<double> position_of(const Plan& plan, const Part& part) {
  VectorX<double> q(part.reduction.q_whole.size());
  for (int i = 0; i < q.size(); ++i) q[i] = plan.question.q[part.reduction.q_whole[i]];
  return q;
}

// Columns and their products: of DoF, and of frames six each.
double selected_flops(const Model<double>& model, const std::vector<int>& dofs,
                      const std::vector<Frame>& frames, double a_column = column) {
  const double size = static_cast<double>(dofs.size() + 6 * frames.size());
  double links = 0;
  for (const int k : dofs) links += depth(model, k);
  for (const Frame& frame : frames) links += 6 * depth(model, frame.link);
  return links * (a_column + size);
}

// Composite inertias, and 30 flops for every joint and every link inboard of it (mass_matrix.hpp).
double mass_flops(const Model<double>& model) {
  double out = 0;
  for (int k = 0; k < model.nv(); ++k) out += 130 + 30 * depth(model, k);
  return out;
}

// log det M without the factors of the filter.
double cholesky_flops(const Model<double>& model) {
  return mass_flops(model) + std::pow(model.nv(), 3) / 3;
}

double spatial_flops(const Plan& plan, const Part& part, Want want, Form form) {
  const Model<double>& model = part.reduction.model;
  const VectorX<double> q = position_of(plan, part), zero = VectorX<double>::Zero(model.nv());
  if (want == Want::acceleration) {
    if (part.kernel == Kernel::spatial_at_rest)
      return acceleration_flops<AtRest>(model, q, zero, zero, part.zeros);
    if (form == Form::square_root)
      return acceleration_flops<SquareRootForm>(model, q, zero, zero, part.zeros);
    const double sweep = acceleration_flops<CovarianceForm>(model, q, zero, zero, part.zeros);
    if (form == Form::conventional) return sweep;
    // The residual in pairs (spatial/pair.hpp), and a solution by factors that are kept.
    constexpr double a_flop_of_pairs = 6;
    return sweep + a_flop_of_pairs * inverse_dynamics_flops(model, q, part.zeros) +
           2 * column * model.nv();
  }
  const FactorFlops cost = factor_flops(model, q, part.zeros);
  switch (want) {
    case Want::diagonal:
      return cost.factors + (plan.partial_answers ? cost.lambda : inverse_flops(model));
    case Want::log_det:
      return plan.partial_answers ? cost.factors + 2 * model.nv() : cholesky_flops(model);
    case Want::inverse:
      return cost.factors +
             (part.block ? selected_flops(model, part.asked, {}) : inverse_flops(model));
    case Want::operational:
      return cost.factors +
             (plan.partial_answers ? selected_flops(model, {}, part.frames) : inverse_flops(model));
    default:
      return 0;
  }
}

// The numbers of planar/: a hinge of the factors, of Lambda, and a link and column of two sweeps
// and of a chosen column.
double planar_flops(const Plan& plan, const Part& part, Want want) {
  constexpr double factor = 61, lambda = 40, sweeps = 26, chosen = 10;
  const Model<double>& model = part.reduction.model;
  const double nv = model.nv();
  switch (want) {
    case Want::acceleration: {
      const PlanarModel<Count> planar(model, *find_plane(model));
      PlanarWorkspace<Count> ws(planar);
      const std::vector<Count> q = detail::counts(position_of(plan, part));
      const std::vector<Count> zero(model.nv(), 0.0);
      std::vector<Count> a(model.nv());
      return detail::counted(
          [&] { planar_acceleration(planar, q.data(), zero.data(), zero.data(), ws, a.data()); });
    }
    case Want::diagonal:
      return factor * nv + (plan.partial_answers ? lambda * nv : sweeps * nv * nv);
    case Want::log_det:
      return plan.partial_answers ? (factor + 2) * nv : cholesky_flops(model);
    case Want::inverse:
      return factor * nv +
             (part.block ? selected_flops(model, part.asked, {}, chosen) : sweeps * nv * nv);
    case Want::operational:
      return factor * nv + (plan.partial_answers ? selected_flops(model, {}, part.frames, chosen)
                                                 : sweeps * nv * nv);
    default:
      return 0;
  }
}

// Two sweeps of a call; all else is known before.
double translational_flops(const Part& part, Want want) {
  constexpr double sweeps = 25;
  return want == Want::acceleration ? sweeps * part.reduction.model.nv() : 0;
}

}  // namespace

double flops(const Plan& plan, Want want, Form form) {
  double out = 0;
  for (const Part& part : plan.parts) {
    if (want == Want::mass)
      out += mass_flops(part.reduction.model);
    else if (part.kernel == Kernel::planar)
      out += planar_flops(plan, part, want);
    else if (part.kernel == Kernel::translational)
      out += translational_flops(part, want);
    else
      out += spatial_flops(plan, part, want, form);
  }
  return std::max(out, 1.0);
}

double flops_of(const Model<double>& model, Want want, Form form) {
  std::set<Rule> rules = rules_for(form);
  rules.erase(Rule::planes);
  return flops(make_plan(model, {.want = {want}}, rules), want, form);
}

}  // namespace kalmarm
