// A unit of a campaign's work: mechanisms of a family and a value, so many seeds from a first one
// on. Its name is
//   FAMILY/VALUE/FIRST+COUNT        wild/1/20001+20000
// with the fewest digits that read back as the value. What a unit shows depends on nothing
// else, whoever works at it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "accuracy/stress/families.hpp"

namespace kalmarm::stress {

inline constexpr std::uint64_t most_seeds = 999'999'999'999'999;  // exact in JSON, whoever reads it

struct Unit {
  const Family* family = nullptr;
  double value = 0;
  std::uint64_t first = 1, count = 1;

  std::string name() const;
};

// From its name. The value is one that the family sweeps: others may be mechanisms again that it
// has, or none. Throws InputError.
Unit unit_of(const std::string& name, const std::vector<Family>& all);

}  // namespace kalmarm::stress
