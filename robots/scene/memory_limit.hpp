// Memory that a request would take, looked at before it is taken: where the system promises more
// than it has, a program is killed without a word.
#pragma once

#include <cstdio>
#include <string>

#include "robots/loader/input_error.hpp"

namespace kalmarm {

inline constexpr double most_memory = 8e9;  // [bytes], of what a command line asks for

// Throws InputError: "chain:1000: 1000000 states take 24 GB; the limit is 8 GB".
inline void refuse_large(const std::string& what, double bytes) {
  if (bytes <= most_memory) return;
  char text[80];
  std::snprintf(text, sizeof text, " take %.2g GB; the limit is %.2g GB", bytes / 1e9,
                most_memory / 1e9);
  throw InputError(what + text);
}

}  // namespace kalmarm
