// The worst states of a robot for the searched variants (judge.hpp), found by optimisers.
//
//   1. random states (random_states of robots/scene/scene.hpp), and those that are given to begin with
//   2. for every variant in float32, from the worst state so far: q by controlled random search
//      within the joints' ranges (NLopt's GN_CRS2_LM), then by a subspace simplex (LN_SBPLX)
//   3. for every variant in float64, from the worst of some random states and of those of float32:
//      q by the simplex, and by the random search before it if float32 refused all: how errors grow
//      along a robot depends on the form and on q, not on the precision
//
// qd and tau stay those of the random state. What is maximised is log10 of the variant's error; a
// state that it refuses counts as no error, a state that is no fair one as less than it is. Not
// searched is where a free body is and how it is turned: M knows nothing of it. Every variant of
// the precision is judged in every state.
//
// What is found is the worst of all verified answers, those to the last bits in the same states
// among them.
#pragma once

#include <cstdint>
#include <vector>

#include "accuracy/limits/judge.hpp"

namespace kalmarm::limits {

struct Effort {
  int random = 200, global = 3000, local = 800;  // states of each step in float32
  int random_float64 = 50, local_float64 = 400;  // and in float64
};

// Of one contender: a variant in a precision.
struct Tally {
  double worst = -1;     // error, verified; negative where it answered in none of the states
  int worst_state = -1;  // of Found::states, where it has that error
  int refused = 0, warned = 0, silent = 0;  // states
  int states = 0;                           // in which it was asked
};

struct Found {
  std::vector<Tally> tallies;  // of every variant in float32, then in float64
  std::vector<State> states;   // the worst ones
  int evaluations = 0;
};

// Of a version of the scene's robot. starts: states to begin with beside the random ones.
Found search_worst(const Scene& scene, const Model<double>& model, Want task, const Effort& effort,
                   std::uint64_t seed, const std::vector<State>& starts);

}  // namespace kalmarm::limits
