// Monte Carlo arithmetic: a scalar whose every rounding is drawn. Results are worked out in long double and
// multiplied by 1 + u xi, xi uniform between -1 and 1, u the unit roundoff of double. Answers of a kernel
// that runs on it spread as roundings can move them, where those of double itself may be right by chance.
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <limits>

#include "algorithms/test/models.hpp"

namespace kalmarm::test {

struct Perturbed {
  static inline Random random{1};
  long double value;

  Perturbed() = default;
  Perturbed(double x) : value(x) {}
  explicit operator double() const { return static_cast<double>(value); }

  friend Perturbed operator+(Perturbed a, Perturbed b) {
    const long double sum = a.value + b.value;
    return sum == b.value ? exactly(sum) : rounded(sum, a.value);
  }
  friend Perturbed operator-(Perturbed a, Perturbed b) {
    return rounded(a.value - b.value, a.value);
  }
  friend Perturbed operator*(Perturbed a, Perturbed b) {
    return rounded(a.value * b.value, a.value);
  }
  friend Perturbed operator/(Perturbed a, Perturbed b) {
    return rounded(a.value / b.value, a.value);
  }
  friend Perturbed operator-(Perturbed a) { return exactly(-a.value); }
  friend Perturbed& operator+=(Perturbed& a, Perturbed b) { return a = a + b; }
  friend Perturbed& operator-=(Perturbed& a, Perturbed b) { return a = a - b; }
  friend bool operator==(Perturbed a, Perturbed b) { return a.value == b.value; }
  friend auto operator<=>(Perturbed a, Perturbed b) { return a.value <=> b.value; }
  friend Perturbed min(Perturbed a, Perturbed b) { return a.value < b.value ? a : b; }
  friend Perturbed zero_where_less(Perturbed a, Perturbed b, Perturbed x) {
    return a.value < b.value ? Perturbed(0) : x;
  }
  friend Perturbed sin(Perturbed a) { return rounded(std::sin(a.value), a.value); }
  friend Perturbed cos(Perturbed a) { return rounded(std::cos(a.value), 1); }

 private:
  static Perturbed exactly(long double x) {
    Perturbed out;
    out.value = x;
    return out;
  }
  // What is exact is so of every draw: of doubles, and where nothing is added or it is multiplied by one.
  static Perturbed rounded(long double x, long double from) {
    if (x == from || static_cast<double>(x) == x) return exactly(x);
    constexpr double u = std::numeric_limits<double>::epsilon() / 2;
    return exactly(x * (1 + static_cast<long double>(u * random.uniform(-1, 1))));
  }
};

}  // namespace kalmarm::test
