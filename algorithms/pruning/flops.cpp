#include "algorithms/pruning/flops.hpp"

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
  double out = 0;
  for (int k = 0; k < model.nv(); ++k) out += column * (depth(model, k) + k + 1);
  return out;
}

// Columns and their products: of DoF, and of sites six each.
double selected_flops(const Model<double>& model, const std::vector<int>& dofs,
                      const std::vector<Site<double>>& sites) {
  const double size = static_cast<double>(dofs.size() + 6 * sites.size());
  double links = 0;
  for (const int k : dofs) links += depth(model, k);
  for (const Site<double>& site : sites) links += 6 * depth(model, site.link);
  return links * (column + size);
}

double spatial_flops(const Plan& plan, const Part& part, Want want) {
  const Model<double>& model = part.reduction.model;
  const VectorX<double> q = plan.question.q(part.reduction.q_whole),
                        zero = VectorX<double>::Zero(model.nv());
  if (want == Want::acceleration)
    return part.kernel == Kernel::spatial_at_rest
               ? acceleration_flops<AtRest>(model, q, zero, zero)
               : acceleration_flops<CovarianceForm>(model, q, zero, zero);
  const FactorFlops cost = factor_flops(model, q);
  switch (want) {
    case Want::diagonal:
      return cost.factors + (plan.partial_answers ? cost.lambda : inverse_flops(model));
    case Want::log_det:
      return cost.factors + 2 * model.nv();
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

}  // namespace

double flops(const Plan& plan, Want want) {
  double out = 0;
  for (const Part& part : plan.parts) out += spatial_flops(plan, part, want);
  return out;
}

}  // namespace kalmarm
