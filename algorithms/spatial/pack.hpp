// n numbers that are worked on at once: a scalar type for kernels that branch on the model alone.
// 8 double or 16 float are a register of AVX-512; where registers are narrower, the compiler uses
// several.
#pragma once

#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

namespace kalmarm {

template <class S>
using IntegerOf = std::conditional_t<sizeof(S) == 4, std::int32_t, std::int64_t>;

template <class S, int n>
struct Pack {
  using Bits = IntegerOf<S>;
  typedef S Vector __attribute__((vector_size(n * sizeof(S))));
  typedef Bits Mask __attribute__((vector_size(n * sizeof(S))));

  Vector v;

  Pack() = default;
  // Of its own, so that what holds packs is copied pack by pack: GCC 12 keeps in memory what is
  // copied as a block.
  [[gnu::always_inline]] Pack(const Pack& x) : v(x.v) {}
  [[gnu::always_inline]] Pack& operator=(const Pack& x) {
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

  friend Pack operator+(Pack a, Pack b) { return of(a.v + b.v); }
  friend Pack operator-(Pack a, Pack b) { return of(a.v - b.v); }
  friend Pack operator*(Pack a, Pack b) { return of(a.v * b.v); }
  friend Pack operator/(Pack a, Pack b) { return of(a.v / b.v); }
  friend Pack operator-(Pack a) { return of(-a.v); }
  friend Pack& operator+=(Pack& a, Pack b) { return a = a + b; }
  friend Pack& operator-=(Pack& a, Pack b) { return a = a - b; }

  friend Pack min(Pack a, Pack b) { return of(a.v < b.v ? a.v : b.v); }
};

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

// Lanes of the widest register there is today: 64 bytes.
template <class S>
using WidePack = Pack<S, 64 / static_cast<int>(sizeof(S))>;

// The first `count` lanes, 0 in the others; nothing behind them is read.
template <class P, class S>
[[gnu::always_inline]] inline P load_first(const S* from, int count) {
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
[[gnu::always_inline]] inline T reciprocal(const T& d) {
  return T(1) / d;
}
#ifdef __AVX512F__
[[gnu::always_inline]] inline Pack<double, 8> reciprocal(const Pack<double, 8>& d) {
  const __m512d x = _mm512_rcp14_pd(d.v);
  const __m512d e = _mm512_fnmadd_pd(d.v, x, _mm512_set1_pd(1));
  const __m512d y = _mm512_fmadd_pd(x, e, x);
  return Pack<double, 8>::of(_mm512_fmadd_pd(y, _mm512_mul_pd(e, e), y));
}
[[gnu::always_inline]] inline Pack<float, 16> reciprocal(const Pack<float, 16>& d) {
  const __m512 x = _mm512_rcp14_ps(d.v);
  return Pack<float, 16>::of(_mm512_fmadd_ps(x, _mm512_fnmadd_ps(d.v, x, _mm512_set1_ps(1)), x));
}
#endif

namespace detail {

// Lanes 0 of a and b, lanes 1 of a and b …: of the lower halves, or of the upper.
template <class P, int first, int... i>
P interleave(const P& a, const P& b, std::integer_sequence<int, i...>) {
  constexpr int n = sizeof...(i);
  return P::of(__builtin_shufflevector(a.v, b.v, (first + i / 2 + (i % 2) * n)...));
}

}  // namespace detail

namespace detail {

// Lane i - step, 0 in the first ones.
template <class P, int step, int... i>
P delayed(const P& x, std::integer_sequence<int, i...>) {
  return P::of(__builtin_shufflevector(P(0).v, x.v, (i < step ? i : sizeof...(i) + i - step)...));
}

template <int step, class S, int n>
[[gnu::always_inline]] inline Pack<S, n> running_sum(const Pack<S, n>& x) {
  if constexpr (step >= n)
    return x;
  else
    return running_sum<2 * step>(
        x + delayed<Pack<S, n>, step>(x, std::make_integer_sequence<int, n>()));
}

}  // namespace detail

// Lane i: the sum of lanes 0 to i, in log2(n) rounds.
template <class S, int n>
[[gnu::always_inline]] inline Pack<S, n> running_sum(const Pack<S, n>& x) {
  return detail::running_sum<1>(x);
}

// rows[i][j] <-> rows[j][i] of n packs. log2(n) rounds, each of which moves row i + n/2 behind i.
template <class S, int n>
void transpose(Pack<S, n>* rows) {
  using P = Pack<S, n>;
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

// x, or 0 where it is so small that its products would underflow: what a joint does to one far away
// fades out, and arithmetic on denormal numbers takes a hundred times as long.
template <class W>
[[gnu::always_inline]] inline W without_tiny(const W& x) {
  if constexpr (Lanes<W>::count > 1) {
    using T = typename Lanes<W>::Scalar;
    constexpr T tiny = std::numeric_limits<T>::min() / std::numeric_limits<T>::epsilon();
    return W::of(((x.v > tiny) | (x.v < -tiny)) ? x.v : W(T(0)).v);
  } else {
    return x;
  }
}

}  // namespace kalmarm
