// What the files of searches hold, as JSON (rounds.hpp, island.hpp).
#pragma once

#include <nlohmann/json.hpp>

#include "accuracy/adversary/rounds.hpp"

namespace kalmarm::adversary {

// What a search is determined by.
nlohmann::json asked_json(const Asked& asked);

// A whole number in the range; InputError with `what` where it is none. A number of JSON would be
// converted to int whatever it is.
int count_of(const nlohmann::json& value, const char* what, int low, int high);

// "bodies" and "x" of an object. Throws InputError where they make no genome.
Genome genome_of(const nlohmann::json& entry);

}  // namespace kalmarm::adversary
