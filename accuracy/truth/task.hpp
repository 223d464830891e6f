// What is asked of a robot in one position, and the true answer. The torque of a task is given or
// made in multi-precision, and then rounded to T:
//
//   torque        tau = value
//   acceleration  tau = M value + bias                      the rounding error alone is answered
//                                                           with an error of u times kappa(M)
//   innovations   tau = (I + K) sqrt(D) value + bias        white noise: each joint is driven on
//                                                           its own scale
// bias: of qd, and of gravity where it is on. The true a is that of the rounded tau.
#pragma once

#include <limits>

#include "accuracy/measures/real.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

enum class Drive { torque, acceleration, innovations };

// T: float or double.
template <class T>
struct Task {
  VectorX<T> value, qd;  // nv values each
  Drive drive = Drive::torque;
  bool gravity = true;
};

// kS (structured_condition.hpp).
struct StructuredCondition {
  double relative = 0, energy = 0;
};

// How far from an acceleration the true one is at most (enclosure.hpp), by the measures of
// measures.hpp. Componentwise: infinite where an entry is zero but for rounding.
struct AccelerationWidth {
  double relative = std::numeric_limits<double>::infinity(), energy = relative,
         componentwise = relative;
};

template <class T>
struct Response {
  VectorX<T> tau;
  VectorX<Real> a;
  AccelerationWidth width;
  StructuredCondition kS;  // zero where it was not asked for
};

}  // namespace kalmarm
