// Sine and cosine of packs, without a branch, and of many angles of any size.
//
//   x = n pi/2 + r + low,  |r| <= pi/4,  low below half a unit in the last place of r
//   pi/2 = P1 + P2 + P3 + P4, so split that n P1, n P2, n P3 and x - n P1 - n P2 are exact
//   sin r = r + r^3 S(r^2),  cos r = 1 - r^2/2 + r^4 C(r^2)     minimax polynomials: fdlibm, Cephes
// n mod 4 says which of the two is the sine of x, and the signs: quarters of a turn that are added
// to x are added to n, and cost no flop.
// Error at most 1.1 ulp, zeros included, as far as the products are exact: P1 and P3 have 33 bits in
// double, and in float P2 and P3 have 11, so that n may have 20 bits and 13, and |x| be
// 2^20 pi/2 = 1.6e6 and 2^13 pi/2 = 1.2e4. What is farther out is seen by one comparison for all
// angles of a call, which the largest x^2 has to pass, and reduced by angle_reduction.hpp. NaN and
// infinity give NaN.
#pragma once

#include <cmath>
#include <cstring>
#include <vector>

#include "algorithms/spatial/angle_reduction.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

namespace detail {

template <class S>
struct SinCosConstants;

template <>
struct SinCosConstants<double> {
  static constexpr double P1 = 0x1.921fb544p+0, P2 = 0x1.0b46p-34, P3 = 0x1.1a626331p-54,
                          P4 = 0x1.1701b839a252p-88;
  static constexpr double round = 0x1.8p52;       // x + round - round is x to an integer
  static constexpr double farthest = 0x1.92p+20;  // |x| for which n has 20 bits
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
  static constexpr float farthest = 0x1.92p+13F;
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

// Of x that is no farther than that, and so many quarters of a turn.
template <class S, int n>
KALMARM_INLINE void sin_cos(const Pack<S, n>& x, const typename Pack<S, n>::Mask& quarters,
                            Pack<S, n>& sin_x, Pack<S, n>& cos_x) {
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

// Of x + offset, one number: where it is so far that the sum loses digits of the offset, by the
// sines and cosines of both.
template <class T>
void sin_cos(const T& x, const T& offset, T& sin_x, T& cos_x) {
  using std::cos;
  using std::sin;
  using K = detail::SinCosConstants<std::conditional_t<std::is_same_v<T, float>, float, double>>;
  const T angle = x + offset;
  if (offset == T(0) || (angle < T(K::farthest) && angle > T(-K::farthest))) {
    sin_x = sin(angle);
    cos_x = cos(angle);
    return;
  }
  const T s = sin(x), c = cos(x), sin_offset = sin(offset), cos_offset = cos(offset);
  sin_x = s * cos_offset + c * sin_offset;
  cos_x = c * cos_offset - s * sin_offset;
}

// float and double take a register's width at once, so arrays of angles are as long as a multiple of
// padding<T>.
template <class T>
inline constexpr std::size_t padding = 1;
template <>
inline constexpr std::size_t padding<float> = Lanes<WidePack<float>>::count;
template <>
inline constexpr std::size_t padding<double> = Lanes<WidePack<double>>::count;

namespace detail {

// A block of angles: whether one is far is seen by its first digits.
template <class Block>
struct AngleBlock;

template <class S, int n>
struct AngleBlock<Pack<S, n>> {
  using Block = Pack<S, n>;
  using Turns = typename Block::Mask;

  KALMARM_INLINE static const Block& first_digits(const Block& angle) { return angle; }
  // A lane of x + offset without its whole quarters of a turn, which are returned.
  static int set_reduced(const Block& x, const Block& offset, int lane, Block& angle) {
    const ReducedAngle at =
        reduced({static_cast<double>(x[lane]), static_cast<double>(offset[lane])});
    angle.set(lane, static_cast<S>(at.r.hi + at.r.lo));
    return at.quarters;
  }
};

// Angles of an array, padding<T> of them at once.
template <class T>
struct AngleBlocks;

template <class T>
requires std::is_floating_point_v<T> &&
    (padding<T> > 1) struct AngleBlocks<T> : AngleBlock<WidePack<T>> {
  using Block = WidePack<T>;

  KALMARM_INLINE static Block load(const std::vector<T>& from, std::size_t i) {
    return Block::load(&from[i]);
  }
  KALMARM_INLINE static typename Block::Mask turns(const std::vector<IntegerOf<T>>& quarters,
                                                   std::size_t i) {
    typename Block::Mask out;
    std::memcpy(&out, &quarters[i], sizeof out);
    return out;
  }
  KALMARM_INLINE static void store(const Block& x, std::vector<T>& to, std::size_t i) {
    x.store(&to[i]);
  }
};

// A state in every lane. S: of one lane.
template <class T, class S>
struct AnglesInLanes : AngleBlock<T> {
  using typename AngleBlock<T>::Turns;

  KALMARM_INLINE static T load(const std::vector<T>& from, std::size_t i) { return from[i]; }
  KALMARM_INLINE static T load(const std::vector<S>& from, std::size_t i) { return from[i]; }
  template <class Integer>
  KALMARM_INLINE static Turns turns(const std::vector<Integer>& quarters, std::size_t i) {
    return quarters[i] - Turns{};
  }
  KALMARM_INLINE static void store(const T& x, std::vector<T>& to, std::size_t i) { to[i] = x; }
};

template <class S, int n>
struct AngleBlocks<Pack<S, n>> : AnglesInLanes<Pack<S, n>, S> {};

// Of the angles that are too far for the reduction above; the others keep what they have.
template <class T, class S, class Integer>
[[gnu::cold]] KALMARM_NOINLINE void sin_cos_of_far(const std::vector<T>& x,
                                                   const std::vector<S>& offset,
                                                   const std::vector<Integer>& quarters,
                                                   std::vector<T>& sin_x, std::vector<T>& cos_x) {
  using Blocks = AngleBlocks<T>;
  for (std::size_t i = 0; i < x.size(); i += padding<T>) {
    const typename Blocks::Block q = Blocks::load(x, i), o = Blocks::load(offset, i);
    typename Blocks::Block angle = q + o, s, c;
    typename Blocks::Turns turns = Blocks::turns(quarters, i);
    using P = std::remove_cvref_t<decltype(Blocks::first_digits(angle))>;
    constexpr auto farthest = SinCosConstants<typename Lanes<P>::Scalar>::farthest;
    bool far = false;
    for (int lane = 0; lane < Lanes<P>::count; ++lane) {
      if (std::abs(Blocks::first_digits(angle)[lane]) <= farthest) continue;
      turns[lane] += Blocks::set_reduced(q, o, lane, angle);
      far = true;
    }
    if (!far) continue;
    sin_cos(angle, turns, s, c);
    Blocks::store(s, sin_x, i);
    Blocks::store(c, cos_x, i);
  }
}

}  // namespace detail

// Of many angles x + offset and quarters, 0 to 3, of a turn: of any size.
template <class T, class S, class Integer>
void sin_cos(const std::vector<T>& x, const std::vector<S>& offset,
             const std::vector<Integer>& quarters, std::vector<T>& sin_x, std::vector<T>& cos_x) {
  if constexpr (requires { detail::AngleBlocks<T>::first_digits; }) {
    using Blocks = detail::AngleBlocks<T>;
    using Block = typename Blocks::Block;
    using P = std::remove_cvref_t<decltype(Blocks::first_digits(Block()))>;
    using K = detail::SinCosConstants<typename Lanes<P>::Scalar>;
    P largest = typename Lanes<P>::Scalar(0);  // square of an angle
    for (std::size_t i = 0; i < x.size(); i += padding<T>) {
      const Block angle = Blocks::load(x, i) + Blocks::load(offset, i);
      const P first = Blocks::first_digits(angle);
      largest = max(largest, first * first);
      Block s, c;
      sin_cos(angle, Blocks::turns(quarters, i), s, c);
      Blocks::store(s, sin_x, i);
      Blocks::store(c, cos_x, i);
    }
    if (any_above(largest, K::farthest * K::farthest))
      detail::sin_cos_of_far(x, offset, quarters, sin_x, cos_x);
  } else {
    for (std::size_t i = 0; i < x.size(); ++i) {
      T s, c;
      sin_cos(x[i], T(offset[i]), s, c);
      const bool swapped = quarters[i] % 2 == 1;
      const T first = swapped ? c : s, second = swapped ? s : c;
      sin_x[i] = quarters[i] >= 2 ? T(-first) : first;
      cos_x[i] = quarters[i] == 1 || quarters[i] == 2 ? T(-second) : second;
    }
  }
}

}  // namespace kalmarm
