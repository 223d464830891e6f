// The advisor (algorithms/advisor/advisor.hpp) on a scene: all contenders of the registry.
#pragma once

#include <string>
#include <vector>

#include "accuracy/contenders/contender.hpp"
#include "algorithms/advisor/advisor.hpp"

namespace kalmarm {

// On the states, for a question that wants something. The forms of the fast path stand first; those
// that take time for nv^3 are left out above 200 DoF, where they cannot win. precision: float32,
// float64 or empty for both. Scene, options and question are to outlive the advisor.
std::unique_ptr<Advisor> make_advisor(const Scene& scene, const QuestionOptions& asked,
                                      const Question& question, const std::vector<State>& states,
                                      const std::string& precision = "");

// Throws InputError where the tolerance is below the roundoff.
Advice advise(Advisor& advisor, double tolerance);

}  // namespace kalmarm
