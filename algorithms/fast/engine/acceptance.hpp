// What the sums that a sweep leaves say of its answer: the estimated error, and whether it is small
// enough to be used. Of one state or one in every lane; a lane that is not accepted climbs to the next
// rung (ladder/narrow_engine.hpp, ladder/spatial_state.hpp).
//
// A sweep leaves for every lane: margin, positive where rounding cannot have moved a D far; for
// accelerations AccelerationSums, for solves N, E and |x|^2 of force_noise.hpp, for the rest check,
// which is zero where every result is finite. Equations are those of force_noise.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "algorithms/fast/covariance/force_noise.hpp"
#include "algorithms/fast/engine/forms.hpp"
#include "algorithms/fast/factors/solve.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

// What AccelerationSums say, of one state or one in every lane.
template <class T>
struct Judged {
  T margin;     // (8): positive where rounding cannot have moved a far
  T error;      // (10) and (12)
  T of_sweeps;  // the square of (10)
};

template <class S>
class Acceptance {
 public:
  Acceptance(const RobotModel& robot, const LoweredModel<S>& lowered, double tolerance)
      : accepted_(square(S(accepted_error_of_a(tolerance)))),
        unit_(lowered.rounding_unit()),
        allowed_(accepted_ * unit_ / square(S(rounding_constant_of_a) * unit_roundoff<S>())),
        largest_variance_(lowered.largest_variance()),
        least_(S(least_beside_gravity * least_beside_gravity) * squares_of(robot.gravity)),
        least_size_(least_ * square(mean_root(lowered.least_inertias()))),
        terms_(lowered.terms_of_columns()) {}

  // NaN where a is not finite.
  template <class T>
  Judged<T> judge(const AccelerationSums<T>& of_a) const {
    using std::min, std::sqrt;
    const T nothing = of_a.squares * T(S(0));
    const T allowed = T(allowed_) / min(of_a.trace, T(largest_variance_));
    const T sum = of_a.noise + T(unit_) * of_a.energy;
    const T size = larger(of_a.size, T(least_size_));
    const T of_sweeps = T(unit_of_error()) * sum / size;
    const T of_answer = T(square(unit_roundoff<S>())) * of_a.rounding / size;
    return {(allowed * larger(of_a.squares, T(least_)) - sum) + nothing,
            sqrt(of_sweeps + of_answer) + nothing, of_sweeps};
  }

  // Whether the sums of x = M^-1 tau pass (8'), by factors whose D pass their own test. false where x
  // is not finite.
  bool accepts(const SolveSums<S>& of_x) const {
    const S sum = of_x.noise + of_unmeasured_D() * of_x.energy;
    return allowed_ / std::min(of_x.trace, largest_variance_) * of_x.squares > sum;
  }
  template <class P>
  bool accepts(const SolveSums<P>& of_x, int lane) const {
    return accepts(SolveSums<S>{of_x.noise[lane], of_x.energy[lane], of_x.squares[lane],
                                detail::number(of_x.trace, lane)});
  }

  // Whether a lane's accelerations are accepted, by the margin of D that its sweep has left, and `by`.
  template <class T>
  bool accepts(const T& margin_of_D, const Judged<T>& by, int lane) const {
    const S D = detail::number(margin_of_D, lane), of_a = detail::number(by.margin, lane);
    const S error = detail::number(by.of_sweeps, lane);
    return D > S(0) && of_a > S(0) && error <= accepted_;
  }

  // Whether columns of M^-1 pass (11), by the sum of D(k) X(k,k).
  bool accepts_columns(const S& energy) const { return accepts_all_of(energy + terms_); }
  // The same by all of S.
  bool accepts_all_of(const S& energy_of_columns) const {
    return unit_ * energy_of_columns < allowed_;
  }

 private:
  template <class T>
  static T square(const T& x) {
    return x * x;
  }

  // (b u)^2, of N in units of its weights.
  S unit_of_error() const {
    return square(S(rounding_constant_of_error) * unit_roundoff<S>()) / unit_;
  }

  // The factor of E in (8'), in units of the weights.
  S of_unmeasured_D() const {
    return S((1 + square(rounding_constant_of_unmeasured_D / rounding_constant_of_a))) * unit_;
  }

  static S squares_of(const std::array<double, 3>& x) {
    return S(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  }

  template <class T>
  static T larger(const T& a, const T& b) {
    using std::min;
    return -min(T(-a), T(-b));
  }

  static S mean_root(const std::vector<S>& x) {
    S sum = S(0);
    for (const S& one : x) sum += std::sqrt(one);
    return x.empty() ? S(0) : sum / S(x.size());
  }

  S accepted_, unit_, allowed_;  // accepted_: e^2
  S largest_variance_;
  S least_, least_size_;  // the least |a|^2 and |a|_s^2
  S terms_;               // (2) of terms_of_columns.hpp
};

}  // namespace kalmarm
