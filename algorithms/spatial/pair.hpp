// A number as an unevaluated sum of two, hi + lo: twice the digits of T, for residuals.
//
// hi is what T alone would compute, lo is its error to first order, which error-free transformations
// give (Knuth; Dekker; Ogita, Rump and Oishi 2005):
//   a + b = s + e     s = fl(a + b),  t = fl(s - a),  e = (a - (s - t)) + (b - t)            (1)
//   a b   = p + e     p = fl(a b),    e = fma(a, b, -p)                                      (2)
// Pairs are not normalised (Lange and Rump 2020, pair arithmetic):
//   (a + a') + (b + b') = s + (e + (a' + b'))                                       8 flops  (3)
//   (a + a') (b + b')   = p + (e + a b' + a' b)                                     4 flops  (4)
//   (a + a') / (b + b') = q + (fma(-q, b, a) + (a' - q b')) / b,   q = fl(a / b)             (5)
//   sqrt(a + a')        = s + (fma(-s, s, a) + a') / 2 s,          s = fl(sqrt a)            (6)
// What is left out is of second order: after a computation whose hi is wrong by e relatively, hi +
// lo is wrong by about e^2 + u^2. A step that loses digits by cancellation loses them of e, too: what
// is left of a difference whose hi is 0 has the digits of T in every product. A kernel that sums
// and then multiplies normalises in between.
//
// (1) and (2) hold as written alone: files that use pairs are compiled without contraction of
// products and sums (-ffp-contract=off). fma of (2) is an instruction
// where there is one, else Dekker's product in 17 flops, whose range ends at 2^996 in double.
#pragma once

#if defined(__FMA__)
#include <immintrin.h>
#define KALMARM_FMA
#elif defined(__ARM_FEATURE_FMA)
#include <arm_neon.h>
#define KALMARM_FMA
#endif

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <type_traits>

#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

namespace detail {

#ifdef KALMARM_FMA
KALMARM_INLINE double fused(double a, double b, double c) { return __builtin_fma(a, b, c); }
#ifdef __FMA__
KALMARM_INLINE __m128d fused(__m128d a, __m128d b, __m128d c) { return _mm_fmadd_pd(a, b, c); }
KALMARM_INLINE __m256d fused(__m256d a, __m256d b, __m256d c) { return _mm256_fmadd_pd(a, b, c); }
#ifdef __AVX512F__
KALMARM_INLINE __m512d fused(__m512d a, __m512d b, __m512d c) { return _mm512_fmadd_pd(a, b, c); }
#endif
#else
KALMARM_INLINE float64x2_t fused(float64x2_t a, float64x2_t b, float64x2_t c) {
  return vfmaq_f64(c, a, b);
}
#endif
#endif

}  // namespace detail

// a b + c, rounded once where there is an instruction for it.
template <class T>
KALMARM_INLINE T multiply_add(const T& a, const T& b, const T& c) {
  if constexpr (requires { a.high; }) {
    return {multiply_add(a.low, b.low, c.low), multiply_add(a.high, b.high, c.high)};
  } else {
#ifdef KALMARM_FMA
    if constexpr (std::is_same_v<T, double>)
      return detail::fused(a, b, c);
    else
      return T::of(detail::fused(a.v, b.v, c.v));
#else
    return a * b + c;
#endif
  }
}

// The error of p = fl(a b), by (2).
template <class T>
KALMARM_INLINE T product_error(const T& a, const T& b, const T& p) {
  if constexpr (requires { a.high; }) {
    return {product_error(a.low, b.low, p.low), product_error(a.high, b.high, p.high)};
  } else {
#ifdef KALMARM_FMA
    return multiply_add(a, b, T(-p));
#else
    const T split = T(0x1p27 + 1);
    const T A = split * a, B = split * b;
    const T a1 = A - (A - a), b1 = B - (B - b), a2 = a - a1, b2 = b - b1;
    return a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2);
#endif
  }
}

template <class T>
struct Pair {
  T hi, lo;

  Pair() = default;
  KALMARM_INLINE constexpr Pair(const T& x) : hi(x), lo(T(0)) {}
  KALMARM_INLINE constexpr Pair(const T& high, const T& low) : hi(high), lo(low) {}
  // A number, or a pair of numbers, in every lane.
  template <class U>
  requires(std::is_arithmetic_v<U> && !std::is_same_v<U, T>) KALMARM_INLINE Pair(U x)
      : hi(T(static_cast<double>(x))), lo(T(0)) {}
  template <class U>
  requires(std::is_same_v<U, double> && !std::is_same_v<U, T>) KALMARM_INLINE Pair(const Pair<U>& x)
      : hi(T(x.hi)), lo(T(x.lo)) {}

  explicit operator double() const requires std::is_same_v<T, double> { return hi + lo; }

  KALMARM_INLINE friend Pair operator-(const Pair& a) { return {-a.hi, -a.lo}; }
  KALMARM_INLINE friend Pair operator+(const Pair& a, const Pair& b) {  // (3)
    const T s = a.hi + b.hi, t = s - a.hi;
    const T e = (a.hi - (s - t)) + (b.hi - t);
    return {s, e + (a.lo + b.lo)};
  }
  KALMARM_INLINE friend Pair operator-(const Pair& a, const Pair& b) {
    const T s = a.hi - b.hi, t = s - a.hi;
    const T e = (a.hi - (s - t)) - (b.hi + t);
    return {s, e + (a.lo - b.lo)};
  }
  KALMARM_INLINE friend Pair operator*(const Pair& a, const Pair& b) {  // (4)
    const T p = a.hi * b.hi;
    return {p, multiply_add(a.lo, b.hi, multiply_add(a.hi, b.lo, product_error(a.hi, b.hi, p)))};
  }
  KALMARM_INLINE friend Pair operator/(const Pair& a, const Pair& b) {  // (5)
    const T q = a.hi / b.hi, p = q * b.hi;
    const T rest = (a.hi - p) - product_error(q, b.hi, p);
    return {q, (rest + (a.lo - q * b.lo)) / b.hi};
  }
  KALMARM_INLINE friend Pair& operator+=(Pair& a, const Pair& b) { return a = a + b; }
  KALMARM_INLINE friend Pair& operator-=(Pair& a, const Pair& b) { return a = a - b; }
  KALMARM_INLINE friend Pair& operator*=(Pair& a, const Pair& b) { return a = a * b; }
  KALMARM_INLINE friend Pair& operator/=(Pair& a, const Pair& b) { return a = a / b; }

  // As the exact sums compare, to first order.
  friend bool operator==(const Pair& a, const Pair& b) { return sign(a - b) == T(0); }
  friend auto operator<=>(const Pair& a, const Pair& b) { return sign(a - b) <=> T(0); }

  friend Pair sqrt(const Pair& a) {  // (6)
    const T s = std::sqrt(a.hi);
    if (!(s > T(0))) return Pair(s);
    const T p = s * s;
    return {s, (((a.hi - p) - product_error(s, s, p)) + a.lo) / (s + s)};
  }
  friend Pair abs(const Pair& a) { return sign(a) < T(0) ? -a : a; }
  friend Pair ldexp(const Pair& a, int by) { return {std::ldexp(a.hi, by), std::ldexp(a.lo, by)}; }
  friend bool isfinite(const Pair& a) { return std::isfinite(a.hi) && std::isfinite(a.lo); }

 private:
  static T sign(const Pair& a) { return a.hi + a.lo; }
};

// (1) of hi and lo.
template <class T, class... More>
KALMARM_INLINE void normalise(Pair<T>& a, More&... more) {
  for (Pair<T>* x : {&a, &more...}) {
    const T s = x->hi + x->lo, t = s - x->hi;
    *x = {s, (x->hi - (s - t)) + (x->lo - t)};
  }
}

}  // namespace kalmarm

template <>
class std::numeric_limits<kalmarm::Pair<double>> : public std::numeric_limits<double> {
 public:
  static constexpr int digits = 104;
  static kalmarm::Pair<double> epsilon() { return 0x1p-103; }
};

template <>
struct Eigen::NumTraits<kalmarm::Pair<double>> : Eigen::GenericNumTraits<kalmarm::Pair<double>> {
  using Real = kalmarm::Pair<double>;
  using NonInteger = Real;
  using Nested = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 2,
    AddCost = 8,
    MulCost = 5
  };
  static Real epsilon() { return 0x1p-103; }
  static Real dummy_precision() { return 0x1p-90; }
};
