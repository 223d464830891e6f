// One variant on one state after another, as JSON: what evaluate writes of each.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "accuracy/contenders/asked_step.hpp"
#include "accuracy/contenders/contender.hpp"

namespace kalmarm {

// Of one state. Where the outcome is a failure the entry is not whole.
struct Result {
  nlohmann::json entry;
  Outcome outcome;

  // Keeps the first failure or warning, and the last estimate of the error. False on failure.
  bool take(Outcome next);
};

using Evaluator = std::function<Result(const State&)>;

// Of a step, whose scene has its model, also the next state beside the acceleration; it is to outlive
// the evaluator. Throws InputError where the variant is unknown, has no such precision or cannot give
// what is wanted.
Evaluator make_evaluator(const Contender& by, const QuestionOptions& asked, const Scene& scene,
                         const Question& question, const AskedStep* step = nullptr);

// Of an outcome that failed or warns, in words.
std::string describe(const Outcome& outcome, const Scene& scene);

// What the outcome of a state adds to its JSON.
void add_outcome(const Outcome& outcome, const Scene& scene, nlohmann::json& entry);

}  // namespace kalmarm
