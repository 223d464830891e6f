// Numbers that follow from the arithmetic.
#pragma once

namespace kalmarm {

// The unit roundoff of pairs: two more bits are lost than two doubles have.
inline constexpr double roundoff_of_pairs = 0x1p-104;

// Errors of doubles that are less, a hundredth of their roundoff, are not told apart.
inline constexpr double least_resolution = 0x1p-60;

// Of what is inverted in double, so that it is right to six digits.
inline constexpr double largest_condition = 0x1p33;

// A weight for what a link cannot absorb: beyond any that a body has, in the range of float.
inline constexpr double no_body = 0x1p100;

}  // namespace kalmarm
