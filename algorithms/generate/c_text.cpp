#include "algorithms/generate/c_text.hpp"

#include <charconv>
#include <cmath>
#include <type_traits>

namespace kalmarm {

template <class S>
std::string c_number(S x) {
  if (std::isinf(x)) return x < 0 ? "-INFINITY" : "INFINITY";
  char text[40];
  std::string out(text, std::to_chars(text, text + sizeof text, x).ptr);
  if (out.find_first_of(".e") == std::string::npos) out += ".0";
  return std::is_same_v<S, float> ? out + "f" : out;
}

template std::string c_number(float);
template std::string c_number(double);

std::string c_identifier(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    out += is_letter || (c >= '0' && c <= '9') ? c : '_';
  }
  return out;
}

std::string unique_identifier(const std::string& prefix, const std::string& name,
                              std::set<std::string>& taken) {
  const std::string first = prefix + c_identifier(name);
  std::string out = first;
  for (int i = 2; !taken.insert(out).second; ++i) out = first + "_" + std::to_string(i);
  return out;
}

}  // namespace kalmarm
