// JSON files that a user brought.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace kalmarm {

// Throws InputError: no JSON, arrays and objects in one another more than 32 deep, one key twice in
// an object. nlohmann's own functions call themselves once a level, and keep the last of two keys
// in silence.
nlohmann::json parsed_json(const std::string& text);

// The same of a file; throws InputError with the path, also where the file cannot be read
// (robots/loader/files/text_file.hpp).
nlohmann::json read_json(const std::string& path);

// The number, where it is one and finite; throws InputError with `what` and the value if not.
double finite_number(const nlohmann::json& value, const std::string& what);

}  // namespace kalmarm
