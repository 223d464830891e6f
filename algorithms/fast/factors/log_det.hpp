// log det M of factors that are kept: the sum of log D(k).
#pragma once

#include <cmath>
#include <numbers>

#include "algorithms/fast/factors/factors.hpp"

namespace kalmarm {

// log det M = -sum of log 1/D, as one product whose exponent is kept apart: nothing overflows, and
// the error is about nv / 2 roundoffs. Not finite where a D is not, or is zero. Of the factors of one
// state in every lane, of that state.
template <class T>
typename Lanes<T>::Scalar log_det(const FastFactors<T>& factors, int lane = 0) {
  using S = typename Lanes<T>::Scalar;
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
    if constexpr (Lanes<T>::count > 1)
      product *= mantissa(at.inverse_D[lane]);
    else
      product *= mantissa(at.inverse_D);
    if (abs(product) < S(small)) product = mantissa(product);
  }
  return -(log(product) + S(exponent) * S(std::numbers::ln2));
}

}  // namespace kalmarm
