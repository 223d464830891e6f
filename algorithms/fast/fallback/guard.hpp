// Whether the answer of a kernel can be used, and what answers in its place where not.
//
// A sweep leaves two numbers for every lane: margin, positive where rounding cannot have moved a D
// far, and check, which is zero where every result is finite. Only a state that fails either pays
// for more: the form's second look, then the fallback.
#pragma once

#include <memory>

#include "algorithms/fast/fallback/fallback.hpp"
#include "algorithms/fast/forms.hpp"
#include "algorithms/fast/instances.hpp"

namespace kalmarm {

template <class S, class F>
class Guard {
 public:
  Guard(const RobotModel& robot, const LoweredModel<S>& lowered)
      : second_(lowered), fallback_(make_fallback<S>(robot, F::form, F::at_rest)) {}

  Fallback<S>& fallback() { return *fallback_; }

  // From what the sweeps have left of a state q, in a lane of `swept`.
  template <class Swept, class T>
  bool suspects(const LoweredModel<S>& lowered, const S* q, const Swept& swept, const T& check,
                int lane = 0) {
    if (detail::number(check, lane) != S(0)) return true;
    if (detail::number(swept.margin, lane) > S(0)) return false;
    return !second_.clears(lowered, q, swept, lane);
  }

 private:
  typename F::template Second<S> second_;
  std::unique_ptr<Fallback<S>> fallback_;
};

}  // namespace kalmarm
