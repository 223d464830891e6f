// Answers of a robot with its couplings imposed (robots/scene/couplings.hpp), made in float64 from what a
// variant answers without them.
#pragma once

#include "accuracy/contenders/evaluation.hpp"
#include "robots/scene/couplings.hpp"

namespace kalmarm {

// What to ask of the variant. Throws InputError where it is not mass, inverse and acceleration of
// the whole robot.
QuestionOptions uncoupled(const QuestionOptions& asked);

// Of an evaluator of uncoupled(asked); the couplings must live as long.
Evaluator coupled(Evaluator free, const Couplings& couplings, const QuestionOptions& asked);

}  // namespace kalmarm
