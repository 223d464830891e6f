// The scalar of truth, Real, whose digits are chosen at run time (multiprecision.hpp); and the
// larger of two numbers of any kind.
#pragma once

#include <cmath>

#include "algorithms/test/multiprecision.hpp"

namespace kalmarm {

// The larger of two; NaN if either is.
template <class S>
S larger(const S& a, const S& b) {
  using std::isnan;
  return isnan(a) || a >= b ? a : b;
}

}  // namespace kalmarm
