// Sine and cosine of packs, without a branch.
//
//   x = n pi/2 + r + low,  |r| <= pi/4,  low below half a unit in the last place of r
//   pi/2 = P1 + P2 + P3 + P4, so split that n P1, n P2, n P3 and x - n P1 - n P2 are exact
//   sin r = r + r^3 S(r^2),  cos r = 1 - r^2/2 + r^4 C(r^2)     minimax polynomials: fdlibm, Cephes
// n mod 4 says which of the two is the sine of x, and the signs: quarters of a turn that are added
// to x are added to n, and cost no flop.
// Error at most 1.1 ulp for |x| <= 1e6 in double and for |x| <= 1.2e4 in float, zeros included;
// farther out it grows without a warning. NaN and infinity give NaN.
#pragma once

#include <cmath>
#include <cstring>
#include <vector>

#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

namespace detail {

template <class S>
struct SinCosConstants;

template <>
struct SinCosConstants<double> {
  static constexpr double P1 = 0x1.921fb544p+0, P2 = 0x1.0b46p-34, P3 = 0x1.1a626331p-54,
                          P4 = 0x1.1701b839a252p-88;
  static constexpr double round = 0x1.8p52;  // x + round - round is x to an integer
  static constexpr double S[] = {1.58969099521155010221e-10, -2.50507602534068634195e-08,
                                 2.75573137070700676789e-06, -1.98412698298579493134e-04,
                                 8.33333333332248946124e-03, -1.66666666666666324348e-01};
  static constexpr double C[] = {-1.13596475577881948265e-11, 2.08757232129817482790e-09,
                                 -2.75573143513906633035e-07, 2.48015872894767294178e-05,
                                 -1.38888888888741095749e-03, 4.16666666666666019037e-02};
};

template <>
struct SinCosConstants<float> {
  static constexpr float P1 = 0x1.92p+0F, P2 = 0x1.fb4p-12F, P3 = 0x1.444p-24F,
                         P4 = 0x1.68c234p-39F;
  static constexpr float round = 0x1.8p23F;
  static constexpr float S[] = {-1.9515295891e-4F, 8.3321608736e-3F, -1.6666654611e-1F};
  static constexpr float C[] = {2.443315711809948e-5F, -1.388731625493765e-3F,
                                4.166664568298827e-2F};
};

template <class P, class S, int terms>
P polynomial(const S (&coefficients)[terms], const P& x) {
  P out = coefficients[0];
  for (int i = 1; i < terms; ++i) out = out * x + P(coefficients[i]);
  return out;
}

}  // namespace detail

// Of x and so many quarters of a turn.
template <class S, int n>
void sin_cos(const Pack<S, n>& x, const typename Pack<S, n>::Mask& quarters, Pack<S, n>& sin_x,
             Pack<S, n>& cos_x) {
  using P = Pack<S, n>;
  using K = detail::SinCosConstants<S>;
  constexpr S two_over_pi = S(0.63661977236758134308);
  const P shifted = x * P(two_over_pi) + P(K::round);
  const typename P::Mask quadrant = (typename P::Mask)shifted.v + quarters;  // its last bits count
  const P turns = shifted - P(K::round);
  const P t = (x - turns * P(K::P1)) - turns * P(K::P2);
  const P r = t - turns * P(K::P3);
  const P low = ((t - r) - turns * P(K::P3)) - turns * P(K::P4);

  const P rr = r * r;
  const P s = r + (r * rr * detail::polynomial(K::S, rr) + low);
  const P c = P(S(1)) - (P(S(0.5)) * rr - (rr * rr * detail::polynomial(K::C, rr) - r * low));

  const typename P::Mask swapped = (quadrant & 1) != 0;
  const typename P::Vector first = swapped ? c.v : s.v, second = swapped ? s.v : c.v;
  sin_x = P::of((quadrant & 2) != 0 ? -first : first);
  cos_x = P::of(((quadrant + 1) & 2) != 0 ? -second : second);
}

template <class S, int n>
void sin_cos(const Pack<S, n>& x, Pack<S, n>& sin_x, Pack<S, n>& cos_x) {
  if constexpr (WiderThanRegister<S, n>) {
    sin_cos(x.low, sin_x.low, cos_x.low);
    sin_cos(x.high, sin_x.high, cos_x.high);
  } else {
    sin_cos(x, typename Pack<S, n>::Mask{}, sin_x, cos_x);
  }
}

// sin and cos of many angles x and quarters, 0 to 3, of a turn. float and double take a register's
// width at once, so the arrays are as long as a multiple of padding<T>.
template <class T>
inline constexpr std::size_t padding = 1;
template <>
inline constexpr std::size_t padding<float> = Lanes<WidePack<float>>::count;
template <>
inline constexpr std::size_t padding<double> = Lanes<WidePack<double>>::count;

template <class T, class Integer>
void sin_cos(const std::vector<T>& x, const std::vector<Integer>& quarters, std::vector<T>& sin_x,
             std::vector<T>& cos_x) {
  if constexpr (std::is_floating_point_v<T> && padding < T >> 1) {
    using P = WidePack<T>;
    for (std::size_t i = 0; i < x.size(); i += padding<T>) {
      P s, c;
      typename P::Mask turns;
      std::memcpy(&turns, &quarters[i], sizeof turns);
      sin_cos(P::load(&x[i]), turns, s, c);
      s.store(&sin_x[i]);
      c.store(&cos_x[i]);
    }
  } else if constexpr (Lanes<T>::count > 1) {
    for (std::size_t i = 0; i < x.size(); ++i)
      sin_cos(x[i], quarters[i] - typename T::Mask{}, sin_x[i], cos_x[i]);
  } else {
    using std::cos;
    using std::sin;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const T s = sin(x[i]), c = cos(x[i]);
      const bool swapped = quarters[i] % 2 == 1;
      const T first = swapped ? c : s, second = swapped ? s : c;
      sin_x[i] = quarters[i] >= 2 ? T(-first) : first;
      cos_x[i] = quarters[i] == 1 || quarters[i] == 2 ? T(-second) : second;
    }
  }
}

}  // namespace kalmarm
