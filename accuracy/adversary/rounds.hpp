// Finished rounds of a search as a file, to go on from.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "accuracy/adversary/judge.hpp"
#include "accuracy/adversary/search.hpp"

namespace kalmarm::adversary {

struct Asked {
  Case of;
  std::uint64_t seed = 1;
  bool searches = true;                // false: random genomes alone
  double condition = usual_condition;  // K (judge.hpp)

  const char* method() const { return searches ? "search" : "random"; }
  // Of file names: "Ladder-default-float32-search-1", with the task, the goal, the kernel and
  // rows after the precision where they are not the usual ones: "-inverse-claim".
  std::string slug() const;
};

// The rounds as JSON, with what was asked.
std::string to_json(const Asked& asked, const std::vector<Round>& rounds);

// From a file; none where it is not there. Throws InputError where it is no such file, or was
// written for something else.
std::vector<Round> read_rounds(const std::string& path, const Asked& asked);

}  // namespace kalmarm::adversary
