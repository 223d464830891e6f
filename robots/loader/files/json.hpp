// JSON that a user brought, as a tree. Of its own, since the loader is also compiled on the machines of those who install a source
// distribution, which have no library for it.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace kalmarm {

struct Json {
  enum class Kind { null, boolean, number, text, list, object };

  Kind kind = Kind::null;
  double number = 0;  // of a boolean 0 or 1
  std::string text = {};
  std::vector<Json> list = {};
  std::vector<std::pair<std::string, Json>> members = {};  // in the order of the file

  const Json* find(const std::string& key) const;  // null: of no object, or there is none
};

// RFC 8259, whose numbers are finite. Throws InputError with the line: what is no JSON, lists and objects nested more than 32 deep, a key twice in an
// object, a number that double does not hold.
Json json_of(const std::string& text);

}  // namespace kalmarm
