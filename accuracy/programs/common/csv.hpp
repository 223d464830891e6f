// Fields of a CSV file.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>

namespace kalmarm {

// A name as a field: quoted where CSV asks for it. A spreadsheet takes what begins with = + - @ for a
// formula, and what begins with an apostrophe for text: such a name gets one, which readers take off
// (reports/read/checks.py).
inline std::string field(std::string text) {
  if (text.find_first_of("=+-@'") == 0) text.insert(text.begin(), '\'');
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + '"';
}

inline std::string number(double value) {
  if (std::isnan(value)) return "nan";  // printf writes -nan as well
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

}  // namespace kalmarm
