// Searches genomes for the largest value of an objective.
//
// In rounds. A round starts from the best of some genomes that are drawn at random, or, every other
// time, from one of the best that rounds before have found. From there an evolution strategy of
// NLopt (GN_ESCH) goes on with the same number of bodies, and then its subspace simplex (LN_SBPLX).
// Rounds without these two are what random sampling finds.
//
// A round is determined by the seed, its number and the rounds before it: what was interrupted
// after some rounds goes on as if it had not been.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "accuracy/adversary/genome.hpp"

namespace kalmarm::adversary {

using Objective = std::function<double(const Genome& genome)>;

struct Effort {  // evaluations of a round
  int random = 150, evolution = 250, simplex = 600;

  int sum() const { return random + evolution + simplex; }
};

struct Round {
  Genome best;
  double value = -1e300;
  int evaluations = 0;
  std::vector<std::pair<int, double>> curve;  // evaluations of the round, best of it so far
};

// The round after those that are done.
Round next_round(const Objective& objective, const Effort& effort, std::uint64_t seed,
                 const std::vector<Round>& done);

int evaluations_of(const std::vector<Round>& rounds);
const Round& best_of(const std::vector<Round>& rounds);  // the first of equals

}  // namespace kalmarm::adversary
