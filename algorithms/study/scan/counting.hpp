// The study on counting numbers (spatial/count.hpp): what Eigen's fixed sizes ask of a scalar besides.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "algorithms/spatial/count.hpp"

namespace kalmarm {

inline Count& operator*=(Count& a, Count b) { return a = a * b; }
inline Count& operator/=(Count& a, Count b) { return a = a / b; }
inline Count abs(Count a) { return std::abs(a.value); }

}  // namespace kalmarm

template <>
struct Eigen::NumTraits<kalmarm::Count> : Eigen::GenericNumTraits<double> {
  using Real = kalmarm::Count;
  using NonInteger = kalmarm::Count;
  using Nested = kalmarm::Count;
  using Literal = double;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 0 };
};
