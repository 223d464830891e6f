// What can be told of D in DoubleDouble, for answers that are worked out in it: ok, a warning or a
// refusal, with the joint, its D, and as Outcome::scale the error that rounding can have made of it,
// c u H S- H' by (3) of covariance/rounding_bound.hpp. Included where products and sums are not
// contracted (spatial/double_double.hpp).
//
// A residual in the same precision has the same sines as the sweep, so it does not see what is wrong
// with them: loss(k), the relative error that D(k) may have, is part of every answer's error.
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

  explicit WideTest(const LoweredModel<T>& model) : bound_(model) {}

  // Of the position q with these loads. singular: no digit of some D is left, of which the first is named, tips to
  // base.
  Outcome of_D(const LoweredModel<T>& model, const T* q, const Acting<T>& loads) {
    loss_ = bound_.look(model, q, loads, 1);
    if (loss_.bound < 1) return {};
    Outcome out = named({});
    if (!std::isfinite(out.D) || !std::isfinite(out.scale))
      return {.status = Outcome::Status::not_finite};
    out.status = out.D < -out.scale ? Outcome::Status::indefinite : Outcome::Status::singular;
    return out;
  }

  // What else may be wrong with all D at that position, relatively.
  void add(double loss) { loss_.bound += loss; }

  // The largest relative error that a D at that position may have.
  double error_of_D() const { return loss_.bound; }

  // An answer at that position, whose residual says that its error is `error`. Where it may be too
  // large, a warning that names the joint whose D is the least certain. A residual whose squares
  // overflow says nothing of D: the error is infinite, and no joint is named.
  Outcome of_error(double error) const {
    Outcome out;
    out.error = (std::isnan(error) ? std::numeric_limits<double>::infinity() : error) + loss_.bound;
    if (out.error <= enough_in_two_doubles) return out;
    if (!std::isfinite(error) && loss_.bound <= enough_in_two_doubles) return out;
    out.near_singular = true;
    return named(out);
  }

 private:
  Outcome named(Outcome out) const {
    out.joint = loss_.joint;
    out.D = loss_.D;
    out.scale = loss_.scale;
    return out;
  }

  RoundingBound<T> bound_;
  RoundingLoss loss_;  // of the last position
};

}  // namespace kalmarm
