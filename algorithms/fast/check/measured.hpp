// The error of one answer x beside the exact x*, as a rung has measured it, and what is said of it.
//   d = x - x*,  u: what rounding of the rung may have added to |d|_M                             (1)
//   known:   u <= s |d|_M and sqrt(T) u <= s |d|,  and likewise of x* where sizes come from it    (2)
// s = accepted_share, T a bound of the trace of M^-1, from the energy norm to Euclid's ((4) of force_noise.hpp). An
// error that is within the resolution need not be known, and the last rung need not know it in Euclid's norm.
// Verdicts are about what is left of (1):
//   right:   |d|_M + u <= e max(|x*|_M, 0.01 sqrt(G)),  |d| + sqrt(T) u <= e max(|x*|, 0.01 |gravity|)
//   wrong:   one of |d|_M - u, |d| - sqrt(T) u is above that                                      (3)
// e the tolerance, G = |gravity|^2 times the mass of all that moves; of what gravity has no part in, 0.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/fast/claims/constants.hpp"
#include "kalmarm/check.hpp"

namespace kalmarm {

// Squares.
struct Measured {
  double energy, squares;               // |d|_M, |d|
  double uncertainty;                   // u
  double size, size_squares;            // |x*|_M, |x*|
  double uncertainty_of_size;           // of |x*|_M
  double trace;                         // T itself
  double least = 0, least_squares = 0;  // what a smaller x* counts as

  // In the energy norm.
  bool energy_is_known(double resolution) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    // Sums that overflowed say nothing.
    return energy + size + squares + size_squares < infinity &&
           uncertainty_of_size <= share * size && tells(energy, uncertainty, size, resolution);
  }

  bool is_known(double resolution) const {
    return energy_is_known(resolution) &&
           tells(squares, euclid(uncertainty), size_squares, resolution);
  }

  AnswerError error(double tolerance) const {
    AnswerError out;
    out.error = ratio(energy, size);
    out.euclid = ratio(squares, size_squares);
    out.uncertainty = ratio(uncertainty, size);
    out.verdict = verdict(tolerance);
    return out;
  }

 private:
  static constexpr double share = accepted_share * accepted_share;

  static bool tells(double d, double u, double x, double resolution) {
    return u <= share * d || Bounds(d, u).upper <= resolution * resolution * x;
  }

  double euclid(double of_energy) const { return of_energy == 0 ? 0 : trace * of_energy; }

  // Squares of |d| + u and |d| - u.
  struct Bounds {
    double upper, lower;
    Bounds(double d, double u) {
      const double both = 2 * std::sqrt(d * u);
      upper = (d + u) + both;
      lower = d > u ? (d + u) - both : 0;
    }
  };

  static double ratio(double a, double b) { return a == 0 ? 0 : std::sqrt(a / b); }

  Verdict verdict(double tolerance) const {
    const Bounds in_energy(energy, uncertainty), in_euclid(squares, euclid(uncertainty));
    const double of_energy = tolerance * tolerance * std::max(size, least),
                 of_euclid = tolerance * tolerance * std::max(size_squares, least_squares);
    if (in_energy.upper <= of_energy && in_euclid.upper <= of_euclid) return Verdict::right;
    if (in_energy.lower > of_energy || in_euclid.lower > of_euclid) return Verdict::wrong;
    return Verdict::unknown;
  }
};

// Of an answer that is not finite.
inline AnswerError infinitely_wrong() {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  return {Verdict::wrong, infinity, infinity, 0, {.error = infinity}};
}

// Of a state of which there is no answer.
inline AnswerError no_answer(const Outcome& outcome) {
  AnswerError out;
  out.outcome = outcome;
  return out;
}

}  // namespace kalmarm
