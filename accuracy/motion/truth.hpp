// The true end of a motion (motion.hpp): by Fehlberg's pair of orders 7 and 8 in long double, whose
// unit is 5e-20, over accelerations of Sequential<Conventional> in long double.
//
//   x = (q; v),  x' = (q'; M^-1 (tau(t) - B v - K (q - q0) - bias))                           (1)
// is integrated with a tolerance of a step, relative and absolute, and again with a hundredth of it.
// How far the two ends are apart, by (4) of motion.hpp, is more than the error of the second, which is
// handed out; both differences are kept with it. A motion has no truth where it needs more than `cap`
// calls of (1), or where the ends are farther apart than `agreement`: a chaotic one takes every
// rounding error for another motion.
//
// Nothing of the fast path and of the integrators that are measured takes part. q' of a quaternion is
// taken in its four numbers; its length is kept by (1) and leaves the answer alone.
#pragma once

#include <stdexcept>
#include <string>

#include "accuracy/motion/motion.hpp"

namespace kalmarm::motion {

struct TruthOptions {
  double tolerance = 1e-15;
  double agreement = 1e-12;  // largest difference that is taken
  long cap = 3'000'000;      // calls, of both
};

struct Truth {
  VectorX<long double> q, v;
  Errors difference;  // between the two integrations
  long calls = 0;     // of both
};

// Why there is none, in words with the numbers.
struct NoTruth : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Throws NoTruth.
Truth true_end(const Motion& motion, const TruthOptions& options = {});

}  // namespace kalmarm::motion
