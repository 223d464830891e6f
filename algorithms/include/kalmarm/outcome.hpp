// What a factorisation says of itself. Kernels return it; they never throw, floor or print.
#pragma once

#include <limits>

namespace kalmarm {

struct [[nodiscard]] Outcome {
  enum class Status {
    ok,
    singular,    // D(joint) cannot be told from zero in the working precision
    indefinite,  // D(joint) is negative or not a number: positivity was lost
    not_finite,  // the result overflowed, or the state held a NaN
  };

  // Which precision of the library answered. A variant of the study says refined where D was looked at in a
  // wider one, else float64.
  enum class Rung { float_lanes, float64, refined, two_doubles };

  Status status = Status::ok;
  Rung rung = Rung::float64;
  bool near_singular = false;  // ok, but D(joint) may be wrong by 1 per cent or more
  int joint = -1;    // DoF at which the factorisation stopped, or nearly did; -1 where it did not
  double D = 0;      // its innovation covariance, or Cholesky pivot [kg m^2 or kg]
  double scale = 0;  // what D was compared with, same unit: its size, or the error that it may have
  // Estimated relative error of the answer; NaN if there is none. In which norm: docs/errors.md.
  double error = std::numeric_limits<double>::quiet_NaN();
  int steps = 0;         // of refinement that were accepted
  bool widened = false;  // refined by factors of a wider precision, since its own did not help

  explicit operator bool() const { return status == Status::ok; }

  // Ok, but not to be relied upon: nearly singular, or wrong by 1 per cent by its own estimate.
  bool warns() const { return status == Status::ok && (near_singular || error > 0.01); }
};

inline const char* to_string(Outcome::Status status) {
  switch (status) {
    case Outcome::Status::ok:
      return "ok";
    case Outcome::Status::singular:
      return "singular";
    case Outcome::Status::indefinite:
      return "indefinite";
    case Outcome::Status::not_finite:
      return "not_finite";
  }
  return "?";
}

inline const char* to_string(Outcome::Rung rung) {
  switch (rung) {
    case Outcome::Rung::float_lanes:
      return "float_lanes";
    case Outcome::Rung::float64:
      return "float64";
    case Outcome::Rung::refined:
      return "refined";
    case Outcome::Rung::two_doubles:
      return "two_doubles";
  }
  return "?";
}

}  // namespace kalmarm
