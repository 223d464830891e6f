#include "accuracy/adversary/search_json.hpp"

#include "robots/loader/input_error.hpp"
#include "robots/scene/json_file.hpp"

namespace kalmarm::adversary {

using nlohmann::json;

json asked_json(const Asked& asked) {
  return {{"variant", asked.of.variant},
          {"precision", asked.of.precision},
          {"task", to_string(asked.of.task)},
          {"objective", to_string(asked.of.goal)},
          {"kernel", to_string(asked.of.kernel)},
          {"rows", asked.of.rows},
          {"seed", asked.seed},
          {"method", asked.method()},
          {"condition", asked.condition}};
}

int count_of(const json& value, const char* what, int low, int high) {
  if (!value.is_number_integer() || value < low || value > high)
    throw InputError(std::string(what) + " is not a whole number from " + std::to_string(low) +
                     " to " + std::to_string(high));
  return value;
}

Genome genome_of(const json& entry) {
  Genome out;
  out.bodies = count_of(entry.at("bodies"), "bodies", 1, most_dofs);
  for (const json& x : entry.at("x")) {
    out.x.push_back(finite_number(x, "x"));
    if (!(out.x.back() >= 0 && out.x.back() <= 1)) throw InputError("x is not from 0 to 1");
  }
  if (static_cast<int>(out.x.size()) != length_of(out.bodies))
    throw InputError("a genome has the wrong length");
  return out;
}

}  // namespace kalmarm::adversary
