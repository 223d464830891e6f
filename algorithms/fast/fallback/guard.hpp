// Whether the answer of a kernel can be used, and what answers in its place where not.
//
// A sweep leaves two numbers for every lane: margin, how far D(k) stays above the threshold at the
// joint that comes nearest, and check, which is zero where every result is finite. Only a state
// that fails either pays for more: the form's second look, then the fallback. On robots along which
// errors grow (covariance/rounding_growth.hpp) every state goes to the fallback.
#pragma once

#include <memory>

#include "algorithms/fast/fallback/fallback.hpp"
#include "algorithms/fast/forms.hpp"

namespace kalmarm {

template <class S, class F>
class Guard {
 public:
  // grows: errors do, along this robot.
  Guard(const RobotModel& robot, const LoweredModel<S>& lowered, bool grows)
      : second_(lowered),
        suspects_all_(grows),
        fallback_(make_fallback<S>(robot, F::form, F::at_rest, grows)) {}

  Fallback<S>& fallback() { return *fallback_; }

  // Every state.
  bool suspects_all() const { return suspects_all_; }

  // From what the sweeps have left of a state q, in a lane of `swept`.
  template <class Swept, class T>
  bool suspects(const LoweredModel<S>& lowered, const S* q, const Swept& swept, const T& check,
                int lane = 0) {
    if (suspects_all_ || detail::number(check, lane) != S(0)) return true;
    if (detail::number(swept.margin, lane) > S(0)) return false;
    return !second_.clears(lowered, q, swept, lane);
  }

 private:
  typename F::template Second<S> second_;
  bool suspects_all_;
  std::unique_ptr<Fallback<S>> fallback_;
};

}  // namespace kalmarm
