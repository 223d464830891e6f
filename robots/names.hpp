// Names that users give: patterns, and what they may have meant.
#pragma once

#include <string>
#include <vector>

namespace kalmarm {

// "'left_kne' is unknown; nearest: left_knee, left_knee_roll, right_knee": the three names with the
// fewest letters to change.
std::string unknown_name(const std::string& kind, const std::string& name,
                         const std::vector<std::string>& known);

// Shell pattern: * any letters, ? one, [ab] one of these.
bool matches(const std::string& pattern, const std::string& name);

}  // namespace kalmarm
