#include "kalmarm/plan_summary.hpp"

#include "algorithms/dynamics/plan.hpp"

namespace kalmarm {

PlanSummary summary_of(const Plan& plan) {
  PlanSummary out{.asked = plan.asked, .parts = {}, .acted = {}, .singular = plan.singular};
  for (const Part& part : plan.parts)
    out.parts.push_back({to_string(part.kernel), part.reduction.dofs});
  for (const Acted& acted : plan.acted) out.acted.push_back({acted.rule, acted.dofs});
  return out;
}

}  // namespace kalmarm
