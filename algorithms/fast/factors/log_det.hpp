// log det M of factors that are kept: the sum of log D(k).
#pragma once

#include <cmath>
#include <numbers>

#include "algorithms/fast/factors/factors.hpp"

namespace kalmarm {

// log det M = -sum of log 1/D, as one product whose exponent is kept apart: nothing overflows, and
// the error is about nv / 2 roundoffs. Not finite where a D is not, or is zero.
template <class S>
S log_det(const FastFactors<S>& factors) {
  using std::abs;
  using std::frexp;
  using std::log;
  constexpr double small = 0x1p-60;
  S product = S(1);
  long exponent = 0;
  const auto mantissa = [&exponent](const S& x) {
    int own = 0;
    const S out = frexp(x, &own);
    exponent += own;
    return out;
  };
  for (const auto& at : factors.links) {
    product *= mantissa(at.inverse_D);
    if (abs(product) < S(small)) product = mantissa(product);
  }
  return -(log(product) + S(exponent) * S(std::numbers::ln2));
}

}  // namespace kalmarm
