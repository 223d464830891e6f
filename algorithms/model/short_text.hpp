// Numbers in sentences.
#pragma once

#include <cstdio>
#include <string>

namespace kalmarm {

// By a format of printf, without the zeros that fill its exponent: 1e-6, not 1e-06.
inline std::string short_text(const char* format, double number) {
  char text[64];
  std::snprintf(text, sizeof text, format, number);
  std::string out(text);
  const std::size_t e = out.find('e');
  if (e == std::string::npos || e + 2 >= out.size()) return out;
  const std::size_t digits = out.find_first_not_of('0', e + 2);
  out.erase(e + 2, (digits == std::string::npos ? out.size() - 1 : digits) - (e + 2));
  if (out[e + 1] == '+') out.erase(e + 1, 1);
  return out;
}

// 0.27 µs, 43.8 µs, 2.1 ms
inline std::string time_text(double nanoseconds) {
  return nanoseconds < 1e6 ? short_text("%.2g µs", nanoseconds / 1e3)
                           : short_text("%.2g ms", nanoseconds / 1e6);
}

}  // namespace kalmarm
