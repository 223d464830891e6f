// A scalar that counts the flops done with it: additions, multiplications, divisions and roots, one each.
// Sines, cosines, signs and comparisons are free.
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>

namespace kalmarm {

struct Count {
  static inline long flops = 0;
  double value;

  Count() = default;
  Count(double x) : value(x) {}

  friend Count operator+(Count a, Count b) { return counted(a.value + b.value); }
  friend Count operator-(Count a, Count b) { return counted(a.value - b.value); }
  friend Count operator*(Count a, Count b) { return counted(a.value * b.value); }
  friend Count operator/(Count a, Count b) { return counted(a.value / b.value); }
  friend Count operator-(Count a) { return -a.value; }
  friend Count& operator+=(Count& a, Count b) { return a = a + b; }
  friend Count& operator-=(Count& a, Count b) { return a = a - b; }
  friend bool operator==(Count a, Count b) { return a.value == b.value; }
  friend auto operator<=>(Count a, Count b) { return a.value <=> b.value; }
  friend Count min(Count a, Count b) { return std::min(a.value, b.value); }
  friend Count zero_where_less(Count a, Count b, Count x) {
    return a.value < b.value ? 0 : x.value;
  }
  friend Count sqrt(Count a) { return counted(std::sqrt(a.value)); }
  friend Count sin(Count a) { return std::sin(a.value); }
  friend Count cos(Count a) { return std::cos(a.value); }

 private:
  static Count counted(double x) {
    ++flops;
    return x;
  }
};

}  // namespace kalmarm
