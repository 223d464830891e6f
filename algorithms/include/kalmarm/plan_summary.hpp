// What Dynamics::plan() leaves out, in plain numbers and names.
//
//   const kalmarm::PlanSummary plan = kalmarm::summary_of(robot.plan());
#pragma once

#include <string>
#include <vector>

#include "kalmarm/export.hpp"
#include "kalmarm/question.hpp"

namespace kalmarm {

struct Plan;

// DoF are those of the whole robot.
struct PlanSummary {
  struct Part {             // trees that are solved together
    std::string kernel;     // "spatial", "translational", ...
    std::vector<int> dofs;  // that are left
  };
  struct Acted {  // a rule that left something out
    Rule rule;
    std::vector<int> dofs;  // that it is about
  };

  std::vector<int> asked;  // in the order of results
  std::vector<Part> parts;
  std::vector<Acted> acted;
  std::vector<int> singular;  // asked about, but move no inertia: M has no inverse
};

KALMARM_EXPORT PlanSummary summary_of(const Plan& plan);

}  // namespace kalmarm
