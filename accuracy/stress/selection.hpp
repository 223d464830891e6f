// What the programs of this folder choose from: families and variants by name.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "accuracy/stress/families.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::stress {

inline std::vector<Family> all_families() {
  std::vector<Family> all = families();
  for (Family& family : robot_families()) all.push_back(std::move(family));
  return all;
}

inline std::vector<std::string> names_of(const std::vector<Family>& all) {
  std::vector<std::string> names;
  for (const Family& family : all) names.push_back(family.name);
  return names;
}

inline std::vector<std::string> variant_names() {
  std::vector<std::string> names;
  for (const auto& variant : all_variants<double>()) names.push_back(variant.name);
  return names;
}

// Names asked for; "mass*" stands for all that begin so.
inline std::vector<std::string> select(const std::vector<std::string>& asked,
                                       const std::vector<std::string>& known,
                                       const std::string& kind) {
  std::vector<std::string> out;
  for (const std::string& name : asked) {
    const bool prefix = name.ends_with('*');
    const std::string start = prefix ? name.substr(0, name.size() - 1) : name;
    const std::size_t before = out.size();
    for (const std::string& candidate : known)
      if (prefix ? candidate.starts_with(start) : candidate == name) out.push_back(candidate);
    if (out.size() == before)
      throw InputError(kind + " '" + name + "' is unknown; stress --list prints them");
  }
  return out;
}

}  // namespace kalmarm::stress
