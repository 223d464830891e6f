// Dual numbers x + dx e, e^2 = 0, of T a number or a Pack: what a kernel makes of x, and its change along dx.
#pragma once

#include <concepts>

#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

template <class T>
struct Dual {
  using S = typename Lanes<T>::Scalar;

  T x, dx;

  Dual() = default;
  KALMARM_INLINE Dual(const T& of_x, const T& of_dx) : x(of_x), dx(of_dx) {}
  template <std::convertible_to<T> Constant>
  KALMARM_INLINE explicit Dual(const Constant& c) : x(c), dx(S(0)) {}

  KALMARM_INLINE friend Dual operator+(const Dual& a, const Dual& b) {
    return {a.x + b.x, a.dx + b.dx};
  }
  KALMARM_INLINE friend Dual operator-(const Dual& a, const Dual& b) {
    return {a.x - b.x, a.dx - b.dx};
  }
  KALMARM_INLINE friend Dual operator-(const Dual& a) { return {-a.x, -a.dx}; }
  KALMARM_INLINE friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.x * b.x, a.dx * b.x + a.x * b.dx};
  }
  KALMARM_INLINE friend Dual operator*(const S& c, const Dual& a) { return {c * a.x, c * a.dx}; }
  KALMARM_INLINE friend Dual operator*(const Dual& a, const S& c) { return c * a; }
  KALMARM_INLINE friend Dual& operator+=(Dual& a, const Dual& b) { return a = a + b; }
  KALMARM_INLINE friend Dual& operator-=(Dual& a, const Dual& b) { return a = a - b; }
};

template <class T>
struct Lanes<Dual<T>> : Lanes<T> {};

}  // namespace kalmarm
