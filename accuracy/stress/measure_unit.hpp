// A unit of a campaign, measured and written.
//
// A mechanism counts in every precision or in none: it is left out where one of its truths is not
// known. Why: "digits" or "range" (NoTruth), or "singular" and the other names of Outcome::Status.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "accuracy/programs/common/provenance.hpp"
#include "accuracy/stress/tally.hpp"
#include "accuracy/stress/unit.hpp"

namespace kalmarm::stress {

// What is asked of every unit of a campaign. Each list in order, without repetition: it is part of
// the key that files are merged by.
struct Campaign {
  std::vector<std::string> variants, precisions, tasks;  // tasks: of acceleration_tasks
  int worst = 20;                                        // cases kept of each series
};

// seen(measured, precision, seed) is called of every mechanism and precision that has a truth.
using Seen =
    std::function<void(const Measurement& measured, const std::string& precision, std::uint64_t)>;

// Throws InputError with the seed where something else goes wrong.
Tally measure_unit(const Unit& unit, const Campaign& campaign, const Seen& seen);

// As JSON (docs/data-formats.md).
std::string unit_record(const Unit& unit, const Campaign& campaign, const Provenance& made,
                        const Tally& tally);

}  // namespace kalmarm::stress
