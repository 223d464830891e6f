// What is lost in the mechanisms that a plan leaves (recommend.hpp).
#pragma once

#include <vector>

#include "accuracy/recommend.hpp"
#include "algorithms/questions/plan.hpp"
#include "robots/scene.hpp"

namespace kalmarm {

// The worst of all parts in all states.
inline Loss predict(const Plan& plan, const Request& request, const std::vector<State>& states) {
  Loss loss;
  for (const Part& part : plan.parts) {
    const Reduction& reduction = part.reduction;
    LossPredictor predict(reduction.model, request.inverse && !request.acceleration);
    for (const State& state : states)
      loss.worsen(predict(state.q(reduction.q_whole),
                          {state.tau(reduction.dofs), state.qd(reduction.dofs)}));
  }
  return loss;
}

}  // namespace kalmarm
