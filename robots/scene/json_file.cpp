#include "robots/scene/json_file.hpp"

#include <cmath>
#include <set>
#include <vector>

#include "robots/loader/files/text_file.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

constexpr int deepest = 32;           // our own files have six levels
constexpr std::size_t longest = 160;  // bytes of the parser's words and of a value that are told

std::string shortened(const std::string& text) {
  return text.size() <= longest ? text : text.substr(0, longest) + " ...";
}

// "[json.exception.parse_error.101] parse error at line 1, ..." without what is in brackets.
std::string reason(const json::exception& e) {
  const std::string text = e.what();
  const std::size_t end = text.find("] ");
  return shortened(end == std::string::npos ? text : text.substr(end + 2));
}

}  // namespace

json parsed_json(const std::string& text) {
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto look = [&](int depth, json::parse_event_t event, json& parsed) {
    using Event = json::parse_event_t;
    if (depth > deepest)
      throw InputError("arrays and objects are nested more than " + std::to_string(deepest) +
                       " deep");
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(parsed.get<std::string>()).second)
      throw InputError("an object has the key " + shortened(parsed.dump()) + " twice");
    return true;
  };
  try {
    return json::parse(text, look);
  } catch (const json::exception& e) {
    throw InputError("not a JSON file: " + reason(e));
  }
}

json read_json(const std::string& path) {
  const std::string text = read_text_or_stream(path);
  try {
    return parsed_json(text);
  } catch (const InputError& e) {
    throw InputError(path + ": " + e.what());
  }
}

double finite_number(const json& value, const std::string& what) {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    throw InputError(what + " = " +
                     shortened(value.dump(-1, ' ', true, json::error_handler_t::replace)) +
                     " is not a finite number");
  return value;
}

}  // namespace kalmarm
