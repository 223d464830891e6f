// How wrong an answer may be that comes without a warning, relatively; in which norm: docs/errors.md.
//
// Precision is a means. Answers come from the first of a few rungs whose estimated error is well within the
// tolerance: lanes of float (rows of Dynamics<float> alone), double, double refined by residuals in twice the
// precision, two doubles for one number.
#pragma once

#include <type_traits>

namespace kalmarm {

// What the first rung gives ordinary robots at no price.
template <class T>
inline constexpr double default_tolerance = std::is_same_v<T, float> ? 1e-2 : 1e-8;

// The least that may be asked for: answers are refined in any case, mostly to their last bits, and say how
// wrong they are; 3 to 4 times the time of double.
inline constexpr double last_bits = 0x1p-50;

}  // namespace kalmarm
