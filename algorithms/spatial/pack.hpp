// A SIMD pack of n numbers: a scalar type for kernels whose branches depend on the model alone. What
// is wider than a register is two packs of half the width: gcc 12 goes through memory, number by
// number, for vectors that are wider than its registers.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>
#endif

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class S>
using IntegerOf = std::conditional_t<sizeof(S) == 4, std::int32_t, std::int64_t>;

#if defined(__AVX512F__)
inline constexpr int register_bytes = 64;
#elif defined(__AVX__)
inline constexpr int register_bytes = 32;
#else
inline constexpr int register_bytes = 16;
#endif

template <class S, int n>
concept WiderThanRegister = n* static_cast<int>(sizeof(S)) > register_bytes;

template <class S, int n>
struct Pack {
  using Bits = IntegerOf<S>;
  typedef S Vector __attribute__((vector_size(n * sizeof(S))));
  typedef Bits Mask __attribute__((vector_size(n * sizeof(S))));

  Vector v;

  Pack() = default;
  // Of its own, so that what holds packs is copied pack by pack: GCC 12 keeps in memory what is
  // copied as a block.
  KALMARM_INLINE Pack(const Pack& x) : v(x.v) {}
  KALMARM_INLINE Pack& operator=(const Pack& x) {
    v = x.v;
    return *this;
  }
  Pack(S x) : v(x - Vector{}) {}  // in every lane; x - 0 is x, and -0 is kept

  static Pack of(Vector x) {
    Pack out;
    out.v = x;
    return out;
  }
  static Pack load(const S* from) {
    Pack out;
    std::memcpy(&out.v, from, sizeof out.v);
    return out;
  }
  void store(S* to) const { std::memcpy(to, &v, sizeof v); }

  S operator[](int lane) const { return v[lane]; }
  void set(int lane, S x) { v[lane] = x; }

  friend Pack operator+(Pack a, Pack b) { return of(a.v + b.v); }
  friend Pack operator-(Pack a, Pack b) { return of(a.v - b.v); }
  friend Pack operator*(Pack a, Pack b) { return of(a.v * b.v); }
  friend Pack operator/(Pack a, Pack b) { return of(a.v / b.v); }
  friend Pack operator-(Pack a) { return of(-a.v); }
  friend Pack& operator+=(Pack& a, Pack b) { return a = a + b; }
  friend Pack& operator-=(Pack& a, Pack b) { return a = a - b; }

  friend Pack min(Pack a, Pack b) { return of(a.v < b.v ? a.v : b.v); }
  friend Pack max(Pack a, Pack b) { return of(a.v < b.v ? b.v : a.v); }
  // x, but 0 where a < b.
  friend Pack zero_where_less(Pack a, Pack b, Pack x) { return of(a.v < b.v ? Vector{} : x.v); }

  // Over all lanes.
  KALMARM_INLINE friend S sum(const Pack& x) {
    if constexpr (n == 1)
      return x.v[0];
    else
      return sum(
          x.half(std::integral_constant<int, 0>(), std::make_integer_sequence<int, n / 2>()) +
          x.half(std::integral_constant<int, n / 2>(), std::make_integer_sequence<int, n / 2>()));
  }

 private:
  template <class First, int... i>
  KALMARM_INLINE auto half(First, std::integer_sequence<int, i...>) const {
    return Pack<S, n / 2>::of(__builtin_shufflevector(v, v, (First() + i)...));
  }
};

template <class S, int n>
requires WiderThanRegister<S, n>
struct Pack<S, n> {
  using Half = Pack<S, n / 2>;

  Half low, high;

  Pack() = default;
  KALMARM_INLINE Pack(S x) : low(x), high(x) {}
  KALMARM_INLINE Pack(const Half& both) : low(both), high(both) {}  // the same in either half
  KALMARM_INLINE Pack(const Half& first, const Half& second) : low(first), high(second) {}

  KALMARM_INLINE static Pack load(const S* from) {
    return {Half::load(from), Half::load(from + n / 2)};
  }
  KALMARM_INLINE void store(S* to) const {
    low.store(to);
    high.store(to + n / 2);
  }

  S operator[](int lane) const { return lane < n / 2 ? low[lane] : high[lane - n / 2]; }
  void set(int lane, S x) { lane < n / 2 ? low.set(lane, x) : high.set(lane - n / 2, x); }

  KALMARM_INLINE friend Pack operator+(const Pack& a, const Pack& b) {
    return {a.low + b.low, a.high + b.high};
  }
  KALMARM_INLINE friend Pack operator-(const Pack& a, const Pack& b) {
    return {a.low - b.low, a.high - b.high};
  }
  KALMARM_INLINE friend Pack operator*(const Pack& a, const Pack& b) {
    return {a.low * b.low, a.high * b.high};
  }
  KALMARM_INLINE friend Pack operator/(const Pack& a, const Pack& b) {
    return {a.low / b.low, a.high / b.high};
  }
  KALMARM_INLINE friend Pack operator-(const Pack& a) { return {-a.low, -a.high}; }
  KALMARM_INLINE friend Pack& operator+=(Pack& a, const Pack& b) { return a = a + b; }
  KALMARM_INLINE friend Pack& operator-=(Pack& a, const Pack& b) { return a = a - b; }

  KALMARM_INLINE friend Pack min(const Pack& a, const Pack& b) {
    return {min(a.low, b.low), min(a.high, b.high)};
  }
  KALMARM_INLINE friend Pack max(const Pack& a, const Pack& b) {
    return {max(a.low, b.low), max(a.high, b.high)};
  }
  KALMARM_INLINE friend Pack zero_where_less(const Pack& a, const Pack& b, const Pack& x) {
    return {zero_where_less(a.low, b.low, x.low), zero_where_less(a.high, b.high, x.high)};
  }
  KALMARM_INLINE friend S sum(const Pack& x) { return sum(x.low + x.high); }
};

// Whether a lane of x is above `limit`.
template <class S, int n>
KALMARM_INLINE bool any_above(const Pack<S, n>& x, S limit) {
  if constexpr (WiderThanRegister<S, n>) {
    return any_above(x.low, limit) || any_above(x.high, limit);
  } else {
    const typename Pack<S, n>::Mask above = x.v > limit;  // in all bits of a lane, or in none
#ifdef __AVX512F__
    if constexpr (sizeof above == 64)
      return _mm512_test_epi32_mask((__m512i)above, (__m512i)above) != 0;
#endif
#ifdef __AVX__
    if constexpr (sizeof above == 32) return _mm256_movemask_ps((__m256)above) != 0;
#endif
#ifdef __SSE2__
    if constexpr (sizeof above == 16) return _mm_movemask_ps((__m128)above) != 0;
#endif
    for (int i = 0; i < n; ++i)
      if (above[i]) return true;
    return false;
  }
}

template <class T>
struct Lanes {
  using Scalar = T;
  static constexpr int count = 1;
};
template <class S, int n>
struct Lanes<Pack<S, n>> {
  using Scalar = S;
  static constexpr int count = n;
};

// A register full.
template <class S>
using WidePack = Pack<S, register_bytes / static_cast<int>(sizeof(S))>;

// Two registers: two independent recursions hide the latency of a sweep, each step of which depends
// on the one before.
template <class S>
using TwoPacks = Pack<S, 2 * Lanes<WidePack<S>>::count>;

// The packs of `lanes` numbers that x is made of, by their order.
template <int lanes, class P>
KALMARM_INLINE const auto& piece(const P& x, int i) {
  constexpr int pieces = Lanes<P>::count / lanes;
  if constexpr (pieces == 1)
    return x;
  else
    return i < pieces / 2 ? piece<lanes>(x.low, i) : piece<lanes>(x.high, i - pieces / 2);
}

// The first `count` lanes, 0 in the others; nothing behind them is read.
template <class P, class S>
KALMARM_INLINE P load_first(const S* from, int count) {
  constexpr int n = Lanes<P>::count;
  if constexpr (n == 1) {
    return *from;
  } else {
    if (count >= n) return P::load(from);
#ifdef __AVX512VL__
    if constexpr (std::is_same_v<P, Pack<double, 4>>)
      return P::of(_mm256_maskz_loadu_pd(static_cast<__mmask8>((1U << count) - 1), from));
    if constexpr (std::is_same_v<P, Pack<float, 4>>)
      return P::of(_mm_maskz_loadu_ps(static_cast<__mmask8>((1U << count) - 1), from));
#endif
    S lanes[n] = {};
    for (int i = 0; i < count; ++i) lanes[i] = from[i];
    return P::load(lanes);
  }
}

// 1 / d, of a full register within 2 units in the last place: from 14 bits by Newton's steps
// x <- x + x e, e = 1 - d x, which becomes e^2. Not faster than one division, but many of them
// would wait for the divider. NaN where d is zero, infinite or less than the least normal number.
template <class T>
KALMARM_INLINE T reciprocal(const T& d) {
  return T(1) / d;
}
#ifdef __AVX512F__
KALMARM_INLINE Pack<double, 8> reciprocal(const Pack<double, 8>& d) {
  const __m512d x = _mm512_rcp14_pd(d.v);
  const __m512d e = _mm512_fnmadd_pd(d.v, x, _mm512_set1_pd(1));
  const __m512d y = _mm512_fmadd_pd(x, e, x);
  return Pack<double, 8>::of(_mm512_fmadd_pd(y, _mm512_mul_pd(e, e), y));
}
KALMARM_INLINE Pack<float, 16> reciprocal(const Pack<float, 16>& d) {
  const __m512 x = _mm512_rcp14_ps(d.v);
  return Pack<float, 16>::of(_mm512_fmadd_ps(x, _mm512_fnmadd_ps(d.v, x, _mm512_set1_ps(1)), x));
}
#endif

// Square roots, number by number.
template <class S, int n>
KALMARM_INLINE Pack<S, n> sqrt(const Pack<S, n>& x) {
  if constexpr (WiderThanRegister<S, n>) {
    return {sqrt(x.low), sqrt(x.high)};
#ifdef __AVX512F__
  } else if constexpr (std::is_same_v<Pack<S, n>, Pack<double, 8>>) {
    return Pack<S, n>::of(_mm512_sqrt_pd(x.v));
  } else if constexpr (std::is_same_v<Pack<S, n>, Pack<float, 16>>) {
    return Pack<S, n>::of(_mm512_sqrt_ps(x.v));
#endif
#ifdef __AVX__
  } else if constexpr (std::is_same_v<Pack<S, n>, Pack<double, 4>>) {
    return Pack<S, n>::of(_mm256_sqrt_pd(x.v));
  } else if constexpr (std::is_same_v<Pack<S, n>, Pack<float, 8>>) {
    return Pack<S, n>::of(_mm256_sqrt_ps(x.v));
#endif
  } else {
    S lanes[n];
    for (int i = 0; i < n; ++i) lanes[i] = std::sqrt(x[i]);
    return Pack<S, n>::load(lanes);
  }
}

namespace detail {

// Lanes 0 of a and b, lanes 1 of a and b …: of the lower halves, or of the upper.
template <class P, int first, int... i>
P interleave(const P& a, const P& b, std::integer_sequence<int, i...>) {
  constexpr int n = sizeof...(i);
  return P::of(__builtin_shufflevector(a.v, b.v, (first + i / 2 + (i % 2) * n)...));
}

// Lane i - step, 0 in the first ones.
template <class P, int step, int... i>
P delayed(const P& x, std::integer_sequence<int, i...>) {
  return P::of(__builtin_shufflevector(P(0).v, x.v, (i < step ? i : sizeof...(i) + i - step)...));
}

template <int step, class S, int n>
KALMARM_INLINE Pack<S, n> running_sum(const Pack<S, n>& x) {
  if constexpr (step >= n)
    return x;
  else
    return running_sum<2 * step>(
        x + delayed<Pack<S, n>, step>(x, std::make_integer_sequence<int, n>()));
}

}  // namespace detail

// Lane i: the sum of lanes 0 to i, in log2(n) rounds.
template <class S, int n>
KALMARM_INLINE Pack<S, n> running_sum(const Pack<S, n>& x) {
  if constexpr (WiderThanRegister<S, n>) {
    const Pack<S, n / 2> low = running_sum(x.low);
    return {low, Pack<S, n / 2>(low[n / 2 - 1]) + running_sum(x.high)};
  } else {
    return detail::running_sum<1>(x);
  }
}

// rows[i][j] <-> rows[j][i] of n packs. log2(n) rounds, each of which moves row i + n/2 behind i;
// of packs wider than a register the four quarters, and the two off the diagonal change places.
template <class S, int n>
void transpose(Pack<S, n>* rows) {
  using P = Pack<S, n>;
  if constexpr (WiderThanRegister<S, n>) {
    typename P::Half quarters[4][n / 2];
    for (int i = 0; i < n / 2; ++i) {
      quarters[0][i] = rows[i].low;
      quarters[1][i] = rows[i].high;
      quarters[2][i] = rows[n / 2 + i].low;
      quarters[3][i] = rows[n / 2 + i].high;
    }
    for (auto& quarter : quarters) transpose(quarter);
    for (int i = 0; i < n / 2; ++i) {
      rows[i] = {quarters[0][i], quarters[2][i]};
      rows[n / 2 + i] = {quarters[1][i], quarters[3][i]};
    }
  } else {
    constexpr auto lanes = std::make_integer_sequence<int, n>();
    for (int round = 1; round < n; round *= 2) {
      P out[n];
      for (int i = 0; i < n / 2; ++i) {
        out[2 * i] = detail::interleave<P, 0>(rows[i], rows[i + n / 2], lanes);
        out[2 * i + 1] = detail::interleave<P, n / 2>(rows[i], rows[i + n / 2], lanes);
      }
      for (int i = 0; i < n; ++i) rows[i] = out[i];
    }
  }
}

// x, or 0 where it is so small that its products would underflow. Along a chain the response to a
// far joint decays to denormal numbers, whose arithmetic takes a hundred times as long.
template <class W>
KALMARM_INLINE W without_tiny(const W& x) {
  if constexpr (requires { x.high; }) {
    return {without_tiny(x.low), without_tiny(x.high)};
  } else if constexpr (Lanes<W>::count > 1) {
    using T = typename Lanes<W>::Scalar;
    constexpr T tiny = std::numeric_limits<T>::min() / std::numeric_limits<T>::epsilon();
    return W::of(((x.v > tiny) | (x.v < -tiny)) ? x.v : W(T(0)).v);
  } else {
    return x;
  }
}

}  // namespace kalmarm
