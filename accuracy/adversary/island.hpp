// An island of a campaign: a search by a seed of its own, which may start from the best that islands
// before it have found. One process; one file, which says what made it (docs/data-formats.md).
//
// Exchange is by files: the islands of one generation are all given the files of the generation
// before. What they take from them does not depend on the order of files, and is judged again. Two
// generations need different seeds, or they draw the same genomes.
#pragma once

#include <string>
#include <vector>

#include "accuracy/adversary/judge.hpp"
#include "accuracy/adversary/rounds.hpp"
#include "accuracy/programs/common/provenance.hpp"

namespace kalmarm::adversary {

inline constexpr std::size_t emigrants = 5;  // genomes of a file: as many as a search goes on from

struct Island {
  Asked asked;
  int evaluations = 5000;  // at least; rounds are whole
};

// The best genomes in files of islands with the same key, as rounds that took no evaluation. Throws
// InputError where a file is none, or of another key.
std::vector<Round> immigrants(const std::vector<std::string>& files, const Island& island,
                              const Provenance& made, const Objective& objective);

// What was found, the immigrants included.
std::string island_record(const Island& island, const Provenance& made,
                          const std::vector<Round>& rounds, Judge& judge);

}  // namespace kalmarm::adversary
