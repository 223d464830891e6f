// Every numbered equation of the paper as a check, in precision T: float64 or Real.
#pragma once

#include "accuracy/paper/rows.hpp"
#include "algorithms/study/estimation/operators.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

// A mechanism that can be checked, or why not: its outcome, and its process' flaw.
struct Soundness {
  Flaw flaw;
  Outcome outcome;
};
template <class T>
Soundness soundness(const Model<double>& model, const State& state);

// The rows of sections 1 to 6 for one mechanism, and of `beyond` for another or the same. Both must
// be sound, with at most largest_dense joints. O(N^3).
template <class T>
std::vector<Row> check_paper(const Model<double>& paper, const State& at,
                             const Model<double>& beyond, const State& beyond_at);

}  // namespace kalmarm
