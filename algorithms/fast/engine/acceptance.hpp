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

// What sums say of an answer, of one state or one in every lane.
template <class T>
struct Judged {
  T margin;  // positive where it is accepted
  T error;   // estimated, relative
};

template <class S>
class Acceptance {
 public:
  Acceptance(const RobotModel& robot, const LoweredModel<S>& lowered, double tolerance)
      : tolerance_(tolerance),
        accepted_(square(S(accepted_error(tolerance)))),
        of_energy_(square(S(rounding_constant) * unit_roundoff<S>())),
        of_noise_(of_energy_ / lowered.rounding_unit()),
        of_gravity_(of_energy_ * lowered.energy_of_gravity()),
        largest_variance_(lowered.largest_variance()),
        least_(S(least_beside_gravity * least_beside_gravity) * squares_of(robot.gravity)),
        least_size_(least_ * square(mean_root(lowered.least_inertias()))),
        terms_(lowered.terms_of_columns()) {}

  double tolerance() const { return tolerance_; }

  // (8) and (10): accepted in both norms, and the error in each joint's own scale. NaN where a is
  // not finite.
  template <class T>
  Judged<T> judge(const AccelerationSums<T>& of_a) const {
    using std::min, std::sqrt;
    const T nothing = of_a.squares * T(S(0)), e = T(accepted_);
    const T sum = T(of_noise_) * of_a.noise + T(of_energy_) * of_a.energy + T(of_gravity_);
    const T all = sum + T(square(unit_roundoff<S>())) * of_a.rounding;
    const T size = larger(of_a.size, T(least_size_));
    const T euclid =
        e * larger(of_a.squares, T(least_)) - min(of_a.trace, T(largest_variance_)) * sum;
    return {min(euclid, T(e * size - all)) + nothing, sqrt(all / size) + nothing};
  }

  // Whether the sums of x = M^-1 tau pass (8'), by factors whose D pass their own test. false where x
  // is not finite.
  bool accepts(const SolveSums<S>& of_x) const {
    return error_squares(of_x) < accepted_ * of_x.squares;
  }
  template <class P>
  bool accepts(const SolveSums<P>& of_x, int lane) const {
    return accepts(SolveSums<S>{of_x.noise[lane], of_x.energy[lane], of_x.squares[lane],
                                detail::number(of_x.trace, lane)});
  }

  // Whether a lane's accelerations are accepted, by the margin of D that its sweep has left, and `by`.
  template <class T>
  bool accepts(const T& margin_of_D, const Judged<T>& by, int lane) const {
    return detail::number(margin_of_D, lane) > S(0) && detail::number(by.margin, lane) > S(0);
  }

  // (8') as a margin, and the error in Euclid's norm. NaN where x is not finite.
  template <class T>
  Judged<T> judge(const SolveSums<T>& of_x) const {
    using std::sqrt;
    const T nothing = of_x.squares * T(S(0)), error = error_squares(of_x);
    return {T(accepted_) * of_x.squares - error + nothing, sqrt(error / of_x.squares) + nothing};
  }

  // (11) as a margin, and the error of each column in the norm of M.
  template <class T>
  Judged<T> judge_columns(const T& energy_of_columns) const {
    using std::sqrt;
    const T error = T(of_energy_) * energy_of_columns;
    return {T(accepted_) - error, sqrt(error)};
  }
  // What terms of g' l+ that may cancel add to the sum of D(k) X(k,k), of any state; too much for
  // some robots.
  const S& terms_of_columns() const { return terms_; }
  bool accepts_terms_of_columns() const { return accepts_all_of(terms_); }

  // Whether columns of M^-1 pass (11), by the sum of D(k) X(k,k).
  bool accepts_columns(const S& energy) const { return accepts_all_of(energy + terms_); }
  // The same by all of S.
  bool accepts_all_of(const S& energy_of_columns) const {
    return of_energy_ * energy_of_columns < accepted_;
  }

 private:
  // What (8') says of |dx|^2.
  template <class T>
  T error_squares(const SolveSums<T>& of_x) const {
    using std::min;
    const S of_D = square(S(roundings_of_D) * unit_roundoff<S>());
    const T sum = T(of_noise_) * of_x.noise + T(of_energy_ + of_D) * of_x.energy;
    return min(of_x.trace, T(largest_variance_)) * sum;
  }

  template <class T>
  static T square(const T& x) {
    return x * x;
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

  double tolerance_;
  S accepted_;              // e^2
  S of_energy_, of_noise_;  // (c u)^2, and of N in units of its weights
  S of_gravity_;            // (c u)^2 G
  S largest_variance_;
  S least_, least_size_;  // the least |a|^2 and |a|_s^2
  S terms_;               // (2) of terms_of_columns.hpp
};

}  // namespace kalmarm
