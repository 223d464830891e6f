// Angles of any size less their whole turns, for those that are too large for the branch-free
// reduction of sincos.hpp and pair_sincos.hpp:
//   x = r + quarters pi/2 + whole turns,   |r| <= pi/4
// by Payne and Hanek (1983), in integers. x = m 2^e, m of 53 bits. Bits of 2/pi of weight 2^(2-e) and
// above give multiples of 4 in x 2/pi, whole turns, and are left out; W is the 256 bits that follow:
//   m W mod 2^256 = 2 bits, the quadrant, and 254 bits, the fraction of a quarter turn
// What follows W changes the fraction by less than 2^-201. No double is nearer than 2^-62 quarters to
// a multiple of pi/2, so r is known to 2^-139 |r|; as a pair it is right to 2^-104 |r|.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>

#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pair.hpp"

namespace kalmarm {

struct ReducedAngle {
  Pair<double> r;
  int quarters;
};

namespace detail {

inline constexpr Pair<double> half_pi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
inline constexpr double quarter_pi = 0x1.921fb54442d18p-1;

}  // namespace detail

// Never inlined: with its products in the caller's sums, contraction would spoil the pair.
[[gnu::cold]] KALMARM_NOINLINE inline ReducedAngle reduced(double x) {
  using Word = std::uint64_t;
  __extension__ using TwoWords = unsigned __int128;
  static constexpr Word two_over_pi[] = {// its integer part, which is 0, then 1280 bits
                                         0,
                                         0xa2f9836e4e441529,
                                         0xfc2757d1f534ddc0,
                                         0xdb6295993c439041,
                                         0xfe5163abdebbc561,
                                         0xb7246e3a424dd2e0,
                                         0x06492eea09d1921c,
                                         0xfe1deb1cb129a73e,
                                         0xe88235f52ebb4484,
                                         0xe99c7026b45f7e41,
                                         0x3991d639835339f4,
                                         0x9c845f8bbdf9283b,
                                         0x1ff897ffde05980f,
                                         0xef2f118b5a0a6d1f,
                                         0x6d367ecf27cb09b7,
                                         0x4f463f669e5fea2d,
                                         0x7527bac7ebe5f17b,
                                         0x3d0739f78a5292ea,
                                         0x6bfb5fb11f8d5d08,
                                         0x56033046fc7b6bab,
                                         0xf0cfbc209af4361d};
  const double size = std::abs(x);
  if (size <= detail::quarter_pi) return {x, 0};
  if (!(size <= std::numeric_limits<double>::max()))
    return {std::numeric_limits<double>::quiet_NaN(), 0};

  int exponent;  // of x = m 2^(exponent - 53)
  const auto m = static_cast<Word>(std::ldexp(std::frexp(size, &exponent), 53));
  const int first = exponent + 9, shift = first % 64;  // bit of the table at which W begins
  const Word* const at = two_over_pi + first / 64;
  Word product[4], carry = 0;  // m W mod 2^256
  for (int i = 3; i >= 0; --i) {
    const TwoWords both = static_cast<TwoWords>(at[i]) << 64 | at[i + 1];
    const TwoWords sum = static_cast<TwoWords>(static_cast<Word>(both >> (64 - shift))) * m + carry;
    product[i] = static_cast<Word>(sum);
    carry = static_cast<Word>(sum >> 64);
  }

  // f = fraction, or 1 - fraction where that is less.
  const bool rounds_up = product[0] >> 61 & 1;
  const int n = static_cast<int>(product[0] >> 62) + rounds_up;
  Word f[3];
  for (int i = 0; i < 3; ++i) {
    f[i] = product[i] << 2 | product[i + 1] >> 62;
    if (rounds_up) f[i] = ~f[i];
  }
  const int zeros = __builtin_clzll(f[0] | 1);  // 62 at most, since f >= 2^-62
  TwoWords leading = static_cast<TwoWords>(f[0]) << 64 | f[1];
  leading = leading << zeros | static_cast<TwoWords>(f[2]) >> (64 - zeros);
  const auto bits = [&](int from) {
    return static_cast<double>(static_cast<Word>(leading >> from) & ((Word(1) << 53) - 1));
  };
  const Pair<double> quarters = {std::ldexp(bits(75), -53 - zeros),
                                 std::ldexp(bits(22), -106 - zeros)};
  const Pair<double> r = quarters * detail::half_pi;
  const bool negative = x < 0;
  return {negative != rounds_up ? -r : r, negative ? -n : n};
}

// Of a sum, which may be too large for a number to hold what its smaller terms say. r is right to
// 2^-104.
[[gnu::cold]] KALMARM_NOINLINE inline ReducedAngle reduced(std::initializer_list<double> terms) {
  ReducedAngle sum{0.0, 0};
  for (const double x : terms) {
    const ReducedAngle term = reduced(x);
    sum.r += term.r;
    sum.quarters += term.quarters;
  }
  for (; sum.r.hi > detail::quarter_pi; ++sum.quarters) sum.r -= detail::half_pi;
  for (; sum.r.hi < -detail::quarter_pi; --sum.quarters) sum.r += detail::half_pi;
  return sum;
}

}  // namespace kalmarm
