// Names in words: what users give and may have meant, and how many there are of a kind.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kalmarm {

// "'left_kne' is unknown; nearest: left_knee, left_knee_roll, right_knee": the three names with the
// fewest letters to change.
std::string unknown_name(const std::string& kind, const std::string& name,
                         const std::vector<std::string>& known);

// "1 mesh", "2 meshes", "3 couplings of joints".
std::string counted(int count, const std::string& kind);

// "1 connect, 2 actuators": numbers of things by their kinds, in the order in which they were first
// added.
class Counts {
 public:
  void add(const std::string& kind, int count = 1);
  const std::vector<std::pair<std::string, int>>& all() const {
    return counts_;
  }  // of which there are any

 private:
  std::vector<std::pair<std::string, int>> counts_;
};

bool is_utf8(std::string_view text);

// Shell pattern: * any letters, ? one, [ab] one of these.
bool matches(const std::string& pattern, const std::string& name);

}  // namespace kalmarm
