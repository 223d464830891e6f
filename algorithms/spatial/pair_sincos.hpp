// Sine and cosine of pairs (pair.hpp), without a branch.
//
//   x = n pi/2 + r,  |r| <= pi/4 (1 + 1e-9),   pi/2 = A + B + C, three numbers of double
//   n A = p + e exactly; x - p is exact (Sterbenz), and the rest is summed as a pair
//   sin r = r - r^3/3! + r^5/5! - ...,  cos r = 1 - r^2/2! + r^4/4! - ...       Taylor, up to r^29
// Horner's rule takes pairs for the first terms, and numbers of T alone for those from r^19 and r^20
// on, which are below 2^-63 of the result. n mod 4 says which of the two is the sine of x, and the
// signs, as in sincos.hpp. Absolute error below 2^-102; angles beyond 1.6e6 are seen and reduced as
// there. NaN and infinity give NaN.
#pragma once

#include <vector>

#include "algorithms/spatial/pair.hpp"
#include "algorithms/spatial/sincos.hpp"

namespace kalmarm {

namespace detail {

// 1 / n! as a pair: 1 / (n - 1)! divided by n, from 1 on.
inline constexpr int factorials = 30;
inline const Pair<double>* inverse_factorials() {
  static const auto table = [] {
    std::array<Pair<double>, factorials> out;
    out[0] = 1.0;
    for (int n = 1; n < factorials; ++n) {
      const Pair<double> next = out[n - 1] / Pair<double>(static_cast<double>(n));
      const double hi = next.hi + next.lo;
      out[n] = {hi, next.lo - (hi - next.hi)};
    }
    return out;
  }();
  return table.data();
}

// sum over i of (-1)^i y^i / (first + 2 i)!, with pairs for i < wide and T for the others.
template <int first, int wide, int terms, class T>
KALMARM_INLINE Pair<T> alternating_series(const Pair<double>* inverse_factorial, const Pair<T>& y) {
  const auto coefficient = [&](int i) {
    const Pair<double>& c = inverse_factorial[first + 2 * i];
    return i % 2 == 0 ? c : -c;
  };
  T tail = T(coefficient(terms - 1).hi);
  for (int i = terms - 2; i >= wide; --i) tail = multiply_add(tail, y.hi, T(coefficient(i).hi));
  Pair<T> sum = tail;
  for (int i = wide - 1; i >= 0; --i) {
    const Pair<T> product = sum * y, c = coefficient(i);  // |product| < |c|: 3 flops for (1)
    const T s = c.hi + product.hi;
    sum = {s, (product.hi - (s - c.hi)) + (product.lo + c.lo)};
  }
  return sum;
}

}  // namespace detail

// Of x and so many quarters of a turn. P: a pack of doubles of a register's width.
template <class P>
void sin_cos(const Pair<P>& x, const typename P::Mask& quarters, Pair<P>& sin_x, Pair<P>& cos_x) {
  constexpr double A = 0x1.921fb54442d18p+0, B = 0x1.1a62633145c07p-54, C = -0x1.f1976b7ed8fbcp-110;
  constexpr double round = detail::SinCosConstants<double>::round;
  const P shifted = x.hi * P(0.63661977236758134308) + P(round);
  const typename P::Mask quadrant = (typename P::Mask)shifted.v + quarters;  // its last bits count
  const P n = shifted - P(round);
  const P p = n * P(A), q = n * P(B);
  const Pair<P> rest = Pair<P>(x.lo) - Pair<P>(product_error(n, P(A), p)) -
                       Pair<P>(q, product_error(n, P(B), q) + n * P(C));
  const Pair<P> r = Pair<P>(x.hi - p) + rest;

  const Pair<double>* const table = detail::inverse_factorials();
  const Pair<P> rr = r * r;
  const Pair<P> s = r - r * rr * detail::alternating_series<3, 8, 14>(table, rr);
  const Pair<P> c = Pair<P>(P(1.0)) - rr * detail::alternating_series<2, 9, 14>(table, rr);

  const auto select = [](const typename P::Mask& which, const P& yes, const P& no) {
    return P::of(which ? yes.v : no.v);
  };
  const typename P::Mask swapped = (quadrant & 1) != 0;
  const Pair<P> first = {select(swapped, c.hi, s.hi), select(swapped, c.lo, s.lo)};
  const Pair<P> second = {select(swapped, s.hi, c.hi), select(swapped, s.lo, c.lo)};
  const typename P::Mask minus_sin = (quadrant & 2) != 0, minus_cos = ((quadrant + 1) & 2) != 0;
  sin_x = {select(minus_sin, -first.hi, first.hi), select(minus_sin, -first.lo, first.lo)};
  cos_x = {select(minus_cos, -second.hi, second.hi), select(minus_cos, -second.lo, second.lo)};
}

// The angle of (x, y): with t of T alone, t + (y cos t - x sin t) / (x cos t + y sin t) is wrong by a
// third of the cube of what t is wrong by.
inline Pair<double> atan2(const Pair<double>& y, const Pair<double>& x) {
  using P = WidePack<double>;
  const double t = std::atan2(y.hi, x.hi);
  Pair<P> sin_t, cos_t;
  sin_cos(Pair<P>(P(t)), typename P::Mask{}, sin_t, cos_t);
  const Pair<double> s = {sin_t.hi[0], sin_t.lo[0]}, c = {cos_t.hi[0], cos_t.lo[0]};
  if (x.hi == 0 && y.hi == 0) return t;
  return Pair<double>(t) + (y * c - x * s) / (x * c + y * s);
}

template <>
inline constexpr std::size_t padding<Pair<double>> = padding<double>;

namespace detail {

template <class P>
struct AngleBlock<Pair<P>> {
  using Block = Pair<P>;
  using Turns = typename P::Mask;

  KALMARM_INLINE static const P& first_digits(const Block& angle) { return angle.hi; }
  static int set_reduced(const Block& x, const Block& offset, int lane, Block& angle) {
    const ReducedAngle at = reduced({x.hi[lane], x.lo[lane], offset.hi[lane], offset.lo[lane]});
    angle.hi.set(lane, at.r.hi);
    angle.lo.set(lane, at.r.lo);
    return at.quarters;
  }
};

template <class P>
struct AngleBlocks<Pair<P>> : AnglesInLanes<Pair<P>, Pair<double>> {};

// Of numbers that have hi and lo in double.
template <class Two>
struct AnglesOfTwo : AngleBlock<Pair<WidePack<double>>> {
  static constexpr int lanes = padding<double>;

  KALMARM_INLINE static Block load(const std::vector<Two>& from, std::size_t i) {
    Block out;
    for (int lane = 0; lane < lanes; ++lane) {
      out.hi.set(lane, from[i + lane].hi);
      out.lo.set(lane, from[i + lane].lo);
    }
    return out;
  }
  template <class Integer>
  KALMARM_INLINE static Turns turns(const std::vector<Integer>& quarters, std::size_t i) {
    return AngleBlocks<double>::turns(quarters, i);
  }
  KALMARM_INLINE static void store(const Block& x, std::vector<Two>& to, std::size_t i) {
    for (int lane = 0; lane < lanes; ++lane) to[i + lane] = Two(x.hi[lane], x.lo[lane]);
  }
};

template <>
struct AngleBlocks<Pair<double>> : AnglesOfTwo<Pair<double>> {};

}  // namespace detail

}  // namespace kalmarm
