// Three numbers: a vector in space, of T or of packs; a rotation by its columns.
#pragma once

#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class T>
struct Triple {
  T x, y, z;

  KALMARM_INLINE Triple& operator+=(const Triple& a) {
    x += a.x;
    y += a.y;
    z += a.z;
    return *this;
  }
};

template <class T>
KALMARM_INLINE Triple<T> operator+(const Triple<T>& a, const Triple<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
KALMARM_INLINE Triple<T> operator-(const Triple<T>& a, const Triple<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T, class U>
KALMARM_INLINE Triple<T> operator*(const U& by, const Triple<T>& a) {
  return {by * a.x, by * a.y, by * a.z};
}
template <class T>
KALMARM_INLINE T dot(const Triple<T>& a, const Triple<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
KALMARM_INLINE Triple<T> cross(const Triple<T>& a, const Triple<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// The axes of a body.
template <class T>
struct Triad {
  Triple<T> x, y, z;

  // R (a, b, c), and R'v.
  template <class U>
  KALMARM_INLINE Triple<T> turned(const U& a, const U& b, const U& c) const {
    return a * x + b * y + c * z;
  }
  KALMARM_INLINE Triple<T> back(const Triple<T>& v) const {
    return {dot(x, v), dot(y, v), dot(z, v)};
  }
};

}  // namespace kalmarm
