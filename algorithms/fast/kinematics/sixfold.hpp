// Six numbers of a force or a motion, what turns and permutes them, and a zero that costs nothing.
#pragma once

#include "algorithms/fast/lowering/lowered_model.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// A number that is known to be zero: the compiler removes every term with it.
struct Zero {
  friend Zero operator+(Zero, Zero) { return {}; }
  friend Zero operator-(Zero, Zero) { return {}; }
  friend Zero operator*(Zero, Zero) { return {}; }
};
template <class T>
T operator+(const T& x, Zero) {
  return x;
}
template <class T>
T operator+(Zero, const T& x) {
  return x;
}
template <class T>
T operator-(const T& x, Zero) {
  return x;
}
template <class T>
T operator-(Zero, const T& x) {
  return -x;
}
template <class T>
Zero operator*(const T&, Zero) {
  return {};
}
template <class T>
Zero operator*(Zero, const T&) {
  return {};
}

// Moment (x, y, z) and force (u, v, w), or their motions.
template <class T>
struct Sixfold {
  T x, y, z, u, v, w;
};

template <class T>
KALMARM_INLINE void add(Sixfold<T>& to, const Sixfold<T>& from) {
  to.x += from.x;
  to.y += from.y;
  to.z += from.z;
  to.u += from.u;
  to.v += from.v;
  to.w += from.w;
}

// (x, y) turned by (c, s), and back.
template <class T, class X, class Y, class C>
KALMARM_INLINE void turn(const Direction<C>& by, const X& x, const Y& y, T& out_x, T& out_y) {
  const T new_x = by.c * x - by.s * y;
  out_y = by.s * x + by.c * y;
  out_x = new_x;
}
template <class T, class C>
KALMARM_INLINE void turn_back(const Direction<C>& by, T& x, T& y) {
  const T new_x = by.c * x + by.s * y;
  y = by.c * y - by.s * x;
  x = new_x;
}

// The follower's phi: (x, y, z) of the link are (y, z, x) of its parent.
template <class T>
KALMARM_INLINE Sixfold<T> cycle(const Sixfold<T>& z) {
  return {z.z, z.x, z.y, z.w, z.u, z.v};
}

namespace detail {

// Number by number: gcc keeps in memory what is assigned as a whole.
template <class T>
KALMARM_INLINE void set_zero(Sixfold<T>& x) {
  x.x = x.y = x.z = x.u = x.v = x.w = T(0);
}
template <class T>
KALMARM_INLINE void assign(Sixfold<T>& to, const Sixfold<T>& from) {
  to.x = from.x;
  to.y = from.y;
  to.z = from.z;
  to.u = from.u;
  to.v = from.v;
  to.w = from.w;
}
template <class T>
KALMARM_INLINE void cycle(T& x, T& y, T& z) {
  const T first = x;
  x = z;
  z = y;
  y = first;
}
template <class T>
KALMARM_INLINE void cycle_back(T& x, T& y, T& z) {
  const T first = x;
  x = y;
  y = z;
  z = first;
}

}  // namespace detail

}  // namespace kalmarm
