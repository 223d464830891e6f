// A number as the sum of two of double that is kept normalised, |lo| <= u |hi|: 106 bits, whatever
// cancels. For what is too near to singular for double; residuals take pairs (pair.hpp), which
// cost a third but lose second-order terms where hi loses its digits.
//   a + b   relative error 3 u^2     both errors by (1) of pair.hpp, normalised twice      (1)
//   a b                    5 u^2     (2) of pair.hpp, normalised                          (2)
//   a / b                 10 u^2     two digits of quotient and a third for the rest      (3)
// as proven by Joldes, Muller and Popescu (2017), algorithms 6, 11 and 17 but for details that do
// not matter here. u = 2^-53; unit_roundoff of the type is
// 2^-102, which its sines and cosines reach.
//
// Its operations are not inlined: kernels of some thousand of them take minutes to compile otherwise.
// As for pairs: compile without contraction of products and sums.
#pragma once

#include "algorithms/spatial/pair_sincos.hpp"

namespace kalmarm {

struct DoubleDouble {
  double hi, lo;

  DoubleDouble() = default;
  template <class U>
  requires std::is_arithmetic_v<U> DoubleDouble(U x) : hi(static_cast<double>(x)), lo(0) {}
  // Of any two numbers.
  DoubleDouble(double a, double b) : hi(a + b) {
    const double t = hi - a;
    lo = (a - (hi - t)) + (b - t);
  }
  explicit operator double() const { return hi; }

  friend DoubleDouble operator-(const DoubleDouble& a) { return exactly(-a.hi, -a.lo); }
  [[gnu::noinline]] friend DoubleDouble operator+(const DoubleDouble& a,
                                                  const DoubleDouble& b) {  // (1)
    const DoubleDouble s(a.hi, b.hi), t(a.lo, b.lo);
    const DoubleDouble c = ordered(s.hi, s.lo + t.hi);
    return ordered(c.hi, c.lo + t.lo);
  }
  friend DoubleDouble operator-(const DoubleDouble& a, const DoubleDouble& b) { return a + -b; }
  [[gnu::noinline]] friend DoubleDouble operator*(const DoubleDouble& a,
                                                  const DoubleDouble& b) {  // (2)
    const double p = a.hi * b.hi;
    return ordered(p, product_error(a.hi, b.hi, p) + (a.hi * b.lo + a.lo * b.hi));
  }
  [[gnu::noinline]] friend DoubleDouble operator/(const DoubleDouble& a,
                                                  const DoubleDouble& b) {  // (3)
    const double first = a.hi / b.hi;
    const DoubleDouble rest = a - DoubleDouble(first) * b;
    const double second = rest.hi / b.hi;
    const DoubleDouble last = rest - DoubleDouble(second) * b;
    const DoubleDouble sum = ordered(first, second);
    return ordered(sum.hi, sum.lo + last.hi / b.hi);
  }
  friend DoubleDouble& operator+=(DoubleDouble& a, const DoubleDouble& b) { return a = a + b; }
  friend DoubleDouble& operator-=(DoubleDouble& a, const DoubleDouble& b) { return a = a - b; }
  friend DoubleDouble& operator*=(DoubleDouble& a, const DoubleDouble& b) { return a = a * b; }
  friend DoubleDouble& operator/=(DoubleDouble& a, const DoubleDouble& b) { return a = a / b; }

  friend bool operator==(const DoubleDouble& a, const DoubleDouble& b) {
    return a.hi == b.hi && a.lo == b.lo;
  }
  friend auto operator<=>(const DoubleDouble& a, const DoubleDouble& b) {
    return a.hi == b.hi ? a.lo <=> b.lo : a.hi <=> b.hi;
  }

  friend DoubleDouble sqrt(const DoubleDouble& a) {
    const double s = std::sqrt(a.hi);
    if (!(s > 0)) return s;
    const DoubleDouble rest = a - DoubleDouble(s) * DoubleDouble(s);
    return ordered(s, rest.hi / (2 * s));
  }
  friend DoubleDouble abs(const DoubleDouble& a) { return a.hi < 0 ? -a : a; }
  friend DoubleDouble ldexp(const DoubleDouble& a, int by) {
    return exactly(std::ldexp(a.hi, by), std::ldexp(a.lo, by));
  }
  friend bool isfinite(const DoubleDouble& a) { return std::isfinite(a.hi); }
  friend DoubleDouble atan2(const DoubleDouble& y, const DoubleDouble& x) {
    const Pair<double> angle = atan2(Pair<double>(y.hi, y.lo), Pair<double>(x.hi, x.lo));
    return {angle.hi, angle.lo};
  }

 private:
  static DoubleDouble exactly(double hi, double lo) {
    DoubleDouble out;
    out.hi = hi;
    out.lo = lo;
    return out;
  }
  // |a| >= |b|, or a is 0.
  static DoubleDouble ordered(double a, double b) {
    const double s = a + b;
    return exactly(s, b - (s - a));
  }
};

template <>
inline constexpr std::size_t padding<DoubleDouble> = padding<double>;

// Numbers side by side, one after another: no processor has lanes of them.
template <int n>
struct Pack<DoubleDouble, n> {
  struct Vector {
    DoubleDouble lanes[n];
    DoubleDouble& operator[](int i) { return lanes[i]; }
    const DoubleDouble& operator[](int i) const { return lanes[i]; }
  };

  Vector v;

  Pack() = default;
  Pack(const DoubleDouble& x) {
    for (DoubleDouble& lane : v.lanes) lane = x;
  }
  static Pack of(const Vector& x) {
    Pack out;
    out.v = x;
    return out;
  }

  friend Pack operator+(const Pack& a, const Pack& b) {
    Pack out;
    for (int i = 0; i < n; ++i) out.v[i] = a.v[i] + b.v[i];
    return out;
  }
  friend Pack operator-(const Pack& a, const Pack& b) {
    Pack out;
    for (int i = 0; i < n; ++i) out.v[i] = a.v[i] - b.v[i];
    return out;
  }
  friend Pack operator*(const Pack& a, const Pack& b) {
    Pack out;
    for (int i = 0; i < n; ++i) out.v[i] = a.v[i] * b.v[i];
    return out;
  }
  friend Pack operator-(const Pack& a) { return Pack(DoubleDouble(0)) - a; }
  friend Pack& operator+=(Pack& a, const Pack& b) { return a = a + b; }
  friend Pack& operator-=(Pack& a, const Pack& b) { return a = a - b; }
};

template <>
struct detail::AngleBlocks<DoubleDouble> : detail::AnglesOfTwo<DoubleDouble> {};

}  // namespace kalmarm

template <>
class std::numeric_limits<kalmarm::DoubleDouble> : public std::numeric_limits<double> {
 public:
  static constexpr int digits = 102;
  static kalmarm::DoubleDouble epsilon() { return 0x1p-101; }
};

template <>
struct Eigen::NumTraits<kalmarm::DoubleDouble> : Eigen::GenericNumTraits<kalmarm::DoubleDouble> {
  using Real = kalmarm::DoubleDouble;
  using NonInteger = Real;
  using Nested = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 2,
    AddCost = 20,
    MulCost = 10
  };
  static Real epsilon() { return 0x1p-101; }
  static Real dummy_precision() { return 0x1p-90; }
};
