#include "algorithms/pruning/flops.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/planar/planar_filter.hpp"
#include "algorithms/structured/at_rest.hpp"
#include "algorithms/structured/flops.hpp"

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
  constexpr int by_blocks = 96;  // links of a chain from which on M^-1 goes by tiles (inverse.hpp)
  const double nv = model.nv();
  bool chain = model.nv() >= by_blocks;
  for (int k = 0; k < model.nv(); ++k) chain = chain && model.parent(k) == k - 1;
  if (chain) return 2300 * nv + 8 * nv * nv;
  double out = 0;
  for (int k = 0; k < model.nv(); ++k) out += column * (depth(model, k) + k + 1);
  return out;
}

// Columns and their products: of DoF, and of sites six each.
double selected_flops(const Model<double>& model, const std::vector<int>& dofs,
                      const std::vector<Site<double>>& sites, double a_column = column) {
  const double size = static_cast<double>(dofs.size() + 6 * sites.size());
  double links = 0;
  for (const int k : dofs) links += depth(model, k);
  for (const Site<double>& site : sites) links += 6 * depth(model, site.link);
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

double spatial_flops(const Plan& plan, const Part& part, Want want) {
  const Model<double>& model = part.reduction.model;
  const VectorX<double> q = plan.question.q(part.reduction.q_whole),
                        zero = VectorX<double>::Zero(model.nv());
  if (want == Want::acceleration)
    return part.kernel == Kernel::spatial_at_rest
               ? acceleration_flops<AtRest>(model, q, zero, zero, part.zeros)
               : acceleration_flops<CovarianceForm>(model, q, zero, zero, part.zeros);
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
             (plan.partial_answers ? selected_flops(model, {}, part.sites) : inverse_flops(model));
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
      const std::vector<Count> q = detail::counts(plan.question.q(part.reduction.q_whole));
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
      return factor * nv + (plan.partial_answers ? selected_flops(model, {}, part.sites, chosen)
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

double flops(const Plan& plan, Want want) {
  double out = 0;
  for (const Part& part : plan.parts) {
    if (want == Want::mass)
      out += mass_flops(part.reduction.model);
    else if (part.kernel == Kernel::planar)
      out += planar_flops(plan, part, want);
    else if (part.kernel == Kernel::translational)
      out += translational_flops(part, want);
    else
      out += spatial_flops(plan, part, want);
  }
  return std::max(out, 1.0);
}

}  // namespace kalmarm
