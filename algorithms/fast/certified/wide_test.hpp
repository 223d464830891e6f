// What can be told of D in DoubleDouble, for answers that are worked out in it: ok, a warning or a
// refusal, with the joint, its D, and as Outcome::scale the error that rounding can have made of it,
// c u H S- H' by (3) of covariance/rounding_bound.hpp. Included where products and sums are not
// contracted (spatial/double_double.hpp).
#pragma once

#include <cmath>
#include <limits>

#include "algorithms/fast/covariance/rounding_bound.hpp"
#include "algorithms/spatial/double_double.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

class WideTest {
 public:
  using T = DoubleDouble;

  // The relative error beyond which an answer warns.
  static constexpr double enough = 1e-7;

  explicit WideTest(const LoweredModel<T>& model) : bound_(model) {}

  // Of a sweep at q, by the margin that it has left. singular: no digit of some D is left, of which
  // the first is named, tips to base. near_singular: less than two digits are.
  Outcome of_D(const LoweredModel<T>& model, const T* q, const T& margin) {
    if (margin > T(0)) return {};
    const RoundingLoss loss = bound_.look(model, q, 1);
    if (loss.bound < largest_error_of_D) return {};
    Outcome out = at(loss);
    if (!std::isfinite(out.D) || !std::isfinite(out.scale))
      return {.status = Outcome::Status::not_finite};
    if (loss.bound < 1)
      out.near_singular = true;
    else
      out.status = out.D < -out.scale ? Outcome::Status::indefinite : Outcome::Status::singular;
    return out;
  }

  // An answer at q whose D have passed as `out`, with its error: where that is too large, a warning
  // that names the joint whose D is the least certain.
  Outcome of_error(const LoweredModel<T>& model, const T* q, Outcome out, double error) {
    if (!(error <= enough) && !out.near_singular) {
      const Outcome named = at(bound_.look(model, q));
      out.near_singular = true;
      out.joint = named.joint;
      out.D = named.D;
      out.scale = named.scale;
    }
    out.error = error;
    return out;
  }

 private:
  static Outcome at(const RoundingLoss& loss) {
    Outcome out;
    out.joint = loss.joint;
    out.D = loss.D;
    out.scale = rounding_constant * static_cast<double>(unit_roundoff<T>()) * loss.scale;
    return out;
  }

  RoundingBound<T> bound_;
};

}  // namespace kalmarm
