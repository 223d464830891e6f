// Whether the answer of a kernel can be used, and what answers in its place where not.
//
// A sweep leaves for every lane: margin, positive where rounding cannot have moved a D far; for
// accelerations the noise of its forces and |a|^2 (force_noise.hpp), for the rest check, which is
// zero where every result is finite. Only a state that fails one of them pays for more: a second
// look, then the certified form for an acceleration, the fallback for what is made of factors alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "algorithms/fast/certified/certified_answer.hpp"
#include "algorithms/fast/fallback/fallback.hpp"
#include "algorithms/fast/forms.hpp"
#include "algorithms/fast/instances.hpp"

namespace kalmarm {

template <class S, class F>
class Guard {
 public:
  Guard(const RobotModel& robot, const LoweredModel<S>& lowered)
      : second_(lowered),
        forces_(lowered),
        allowed_(S(largest_error_of_a<S> * largest_error_of_a<S>) * rounding_unit<S>() /
                 (unit_roundoff<S>() * unit_roundoff<S>())),
        least_(S(0.01 * 0.01) * squares_of(robot.gravity)),
        weight_(weight(robot)),
        own_(lowered),
        a_(lowered.nv()),
        fallback_(make_fallback<S>(robot, F::form)),
        certified_(robot, lowered, F::at_rest) {}

  Fallback<S>& fallback() { return *fallback_; }
  CertifiedAnswer<S>& certified() { return certified_; }

  // (7) of force_noise.hpp, by what a sweep has left: positive where rounding of forces cannot have
  // moved a far; NaN where a is not finite. Of one state, or one in every lane.
  template <class T>
  T margin_of_forces(const T& noise, const T& squares) const {
    using std::min;
    const T larger = -min(T(-squares), T(-least_));
    return T(allowed_ / forces_.constant_trace()) * larger - noise + squares * T(S(0));
  }

  // Whether an acceleration is to be answered anew, from what the sweep has left in a lane of `swept`.
  template <class Swept, class T>
  bool doubts(const LoweredModel<S>& lowered, const S* q, const S* qd, const S* tau,
              const Swept& swept, const T& of_forces, int lane = 0) {
    const S D = detail::number(swept.margin, lane), forces = detail::number(of_forces, lane);
    if (D > S(0) && forces > S(0)) return false;
    if (std::isnan(forces)) return true;
    const double error_of_D = D > S(0) ? 0 : second_.error_of_D(lowered, q, swept, lane);
    if (!(error_of_D < largest_error_of_D)) return true;
    if constexpr (!F::tests_forces)
      return false;
    else if constexpr (std::is_same_v<Swept, typename F::template Workspace<S>>)
      return !clears(lowered, swept, error_of_D);
    else
      return !clears(lowered, q, qd, tau, error_of_D);
  }

  // (8) of force_noise.hpp, by a sweep of its own.
  bool clears(const LoweredModel<S>& lowered, const S* q, const S* qd, const S* tau,
              double error_of_D) {
    F::acceleration(lowered, q, qd, tau, own_, a_.data());
    return clears(lowered, own_, error_of_D);
  }

  // Of factors, from what the sweeps have left of a state q.
  template <class Swept, class T>
  bool suspects(const LoweredModel<S>& lowered, const S* q, const Swept& swept, const T& check,
                int lane = 0) {
    if (detail::number(check, lane) != S(0)) return true;
    if (detail::number(swept.margin, lane) > S(0)) return false;
    return !(second_.error_of_D(lowered, q, swept, lane) < largest_error_of_D);
  }

 private:
  static S squares_of(const std::array<double, 3>& x) {
    return S(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  }

  template <class Swept>
  bool clears(const LoweredModel<S>& lowered, const Swept& swept, double error_of_D) {
    const S most = allowed_ * std::max(swept.squares, least_) / forces_.trace(lowered, swept);
    const S little = S(0.01) * most;
    S N = S(0), E = weight_;
    forces_.begin();
    for (int k = lowered.nv() - 1; k >= 0; --k) {
      const auto& at = swept.links[k];
      N += forces_.charge(lowered, swept, k, swept.z[k], little);
      E += at.e * at.e / at.inverse_D;
    }
    const double of_D = error_of_D / static_cast<double>(unit_roundoff<S>());
    return static_cast<double>(N) + of_D * of_D * static_cast<double>(rounding_unit<S>() * E) <
           static_cast<double>(most);
  }

  // |gravity|^2 sum of m(k)
  static S weight(const RobotModel& robot) {
    double mass = 0;
    for (const LinkParameters& link : robot.links) mass += link.mass;
    return S(mass) * squares_of(robot.gravity);
  }

  typename F::template Second<S> second_;
  ForceNoise<S> forces_;
  S allowed_, least_, weight_;  // e^2 / (c u)^2, the least |a|^2, what E has of gravity
  typename F::template Workspace<S> own_;
  std::vector<S> a_;
  std::unique_ptr<Fallback<S>> fallback_;
  CertifiedAnswer<S> certified_;
};

}  // namespace kalmarm
