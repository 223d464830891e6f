// The advisor (algorithms/advisor/advisor.hpp) on a scene: it advises a tolerance of the ladder, and
// compares it with all other contenders of the registry.
#pragma once

#include <string>
#include <vector>

#include "accuracy/contenders/contender.hpp"
#include "algorithms/advisor/advisor.hpp"

namespace kalmarm {

// One state a call, or all of them: rows, of which the ladder alone has calls.
enum class Calls { of_one_state, of_rows };

// On the states, for a question that wants something. The ladder stands first; contenders that take
// time for nv^3 are left out above 200 DoF, where they cannot win. precision: float32, float64 or empty
// for both, but for one state of the ladder, which float64 answers in any case. Scene, options and
// question are to outlive the advisor.
std::unique_ptr<Advisor> make_advisor(const Scene& scene, const QuestionOptions& asked,
                                      const Question& question, const std::vector<State>& states,
                                      const std::string& precision = "",
                                      Calls calls = Calls::of_one_state);

// Throws InputError where the tolerance is below the roundoff.
Advice advise(Advisor& advisor, double tolerance);

}  // namespace kalmarm
