#include "algorithms/study/flops/flops.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/fast/derivatives/derivatives.hpp"
#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/fast/kinematics/blocks.hpp"
#include "algorithms/fast/rigid/mass.hpp"
#include "algorithms/spatial/pack.hpp"
#include "algorithms/study/flops/counted.hpp"

namespace kalmarm {
namespace {

constexpr double column = 43;       // a link and column of a sweep (columns.hpp)
constexpr double a_solution = 127;  // a link and tau of the factors (solve.hpp)

// Links from k to the base.
int depth(const Model<double>& model, int k) {
  int out = 0;
  for (; k >= 0; k = model.parent(k)) ++out;
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

// Whether M or M^-1 of a chain goes by blocks: from so many pairs of registers on.
bool by_blocks(const LoweredModel<double>& model, int pairs, CallKind call) {
  return is_chain(model, pairs * Lanes<TwoPacks<double>>::count) &&
         !(call.rows && model.nv() <= most_rows_in_lanes);
}

// Of M: composite inertias, and then columns or blocks (mass.hpp).
double mass_flops(const LoweredModel<double>& model, const VectorX<double>& q, CallKind call) {
  const int nv = model.nv();
  if (by_blocks(model, 4, call)) return 1500.0 * nv + 8.0 * nv * nv;
  CompositeForces<Count> composite(model);
  ColumnsWorkspace<Count> ws(model);
  const ColumnPaths paths(model, nv, 1);
  const std::vector<Count> cq = detail::counts(q);
  return detail::counted([&] {
    composite_forces(model, cq.data(), composite);
    for (int k = 0; k < nv; ++k)
      detail::sweep_composite_forces(
          model, composite, k, k, paths[k], [](int) { return Count(1); }, ws);
  });
}

// Of M^-1 after the factors: columns or blocks (inverse.hpp).
double inverse_flops(const LoweredModel<double>& model, const VectorX<double>& q, CallKind call) {
  const int nv = model.nv();
  if (by_blocks(model, 6, call)) return 2300.0 * nv + 8.0 * nv * nv;
  FastFactors<Count> factors(model);
  ColumnsWorkspace<Count> ws(model);
  const ColumnPaths paths(model, nv, 1);
  const std::vector<Count> cq = detail::counts(q);
  covariance_factor(model, cq.data(), factors);
  return detail::counted([&] {
    for (int j = 0; j < nv; ++j) {
      detail::sweep_inward(
          model, factors, j, paths[j], [j](int k) { return Count(k == j ? 1 : 0); }, ws);
      detail::sweep_outward(model, factors, j, ws, [](int, const Count&) {});
    }
  });
}

// Of all three derivatives: sweeps, or tiles of long chains (derivatives.hpp).
double derivative_flops(const LoweredModel<double>& model, const VectorX<double>& q,
                        CallKind call) {
  const int nv = model.nv();
  const bool tiles = !ChainBlocks<double>(model).blocks.empty();
  const bool by_state = !(call.rows && nv <= most_derivatives_in_lanes);
  if (tiles && by_state) return 1300.0 * nv + 3 * 20.0 * nv * nv;
  DerivativeWorkspace<Count> ws(model);
  const std::vector<Count> cq = detail::counts(q), zero(nv, Count(0.0));
  std::vector<Count> dq(static_cast<std::size_t>(nv) * nv), dqd = dq, dtau = dq, a(nv);
  return detail::counted([&] {
    fast_derivatives(model, cq.data(), zero.data(), zero.data(), ws, dq.data(), dqd.data(),
                     dtau.data(), a.data());
  });
}

// log det M without the factors of the filter.
double cholesky_flops(const LoweredModel<double>& model, const VectorX<double>& q) {
  return mass_flops(model, q, {}) + std::pow(model.nv(), 3) / 3;
}

double spatial_flops(const Plan& plan, const Part& part, Want want, double tolerance,
                     CallKind call) {
  const Model<double>& model = part.reduction.model;
  const VectorX<double> q = position_of(plan, part), zero = VectorX<double>::Zero(model.nv());
  if (want == Want::acceleration) {
    if (part.kernel == Kernel::spatial_at_rest)
      return acceleration_flops<AtRest>(model, q, zero, zero, part.zeros);
    const double sweep = acceleration_flops<CovarianceForm>(model, q, zero, zero, part.zeros);
    if (tolerance >= least_tolerance_of_double) return sweep;
    // The residual in pairs (spatial/pair.hpp), and a solution by factors that are kept.
    constexpr double a_flop_of_pairs = 6;
    return sweep + a_flop_of_pairs * inverse_dynamics_flops(model, q, part.zeros) +
           2 * column * model.nv();
  }
  const LoweredModel<double> lowered(model, part.zeros);
  const FactorFlops cost = factor_flops(model, q, part.zeros);
  switch (want) {
    case Want::diagonal:
      return cost.factors + (plan.partial_answers ? cost.lambda : inverse_flops(lowered, q, call));
    case Want::log_det:
      return plan.partial_answers ? cost.factors + 2 * model.nv() : cholesky_flops(lowered, q);
    case Want::inverse:
      return cost.factors +
             (part.block ? selected_flops(model, part.asked, {}) : inverse_flops(lowered, q, call));
    case Want::operational:
    case Want::operational_diagonal:  // at most
      return cost.factors + (plan.partial_answers ? selected_flops(model, {}, part.frames)
                                                  : inverse_flops(lowered, q, call));
    case Want::solve:
      return cost.factors + a_solution * model.nv();
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

double flops(const Plan& plan, Want want, double tolerance, CallKind call) {
  double out = 0;
  for (const Part& part : plan.parts) {
    const Model<double>& model = part.reduction.model;
    if (want == Want::mass)
      out += mass_flops(LoweredModel<double>(model, part.zeros), position_of(plan, part), call);
    else if (want == Want::inverse_dynamics)
      out += inverse_dynamics_flops(model, position_of(plan, part), part.zeros);
    else if (want == Want::derivatives)
      out +=
          derivative_flops(LoweredModel<double>(model, part.zeros), position_of(plan, part), call);
    else if (part.kernel == Kernel::translational)
      out += translational_flops(part, want);
    else
      out += spatial_flops(plan, part, want, tolerance, call);
  }
  return std::max(out, 1.0);
}

double flops_of(const Model<double>& model, Want want, std::optional<double> tolerance,
                CallKind call) {
  const double within = tolerance.value_or(default_tolerance<double>);
  return flops(make_plan(model, {.want = {want}}, rules_for(within)), want, within, call);
}

}  // namespace kalmarm
