// The articulated inertia of the fast path: P of the conventional form (study/riccati/conventional.hpp)
// as 21 numbers, and its arithmetic.
//
//   P = [A B; B' C]       A and C symmetric: A of moments, C of forces, B between them
//   P = M(k) = [I  h~; -h~  m 1]       a body alone, h = m c, I about the link's origin
//   z += P+ c                                                             (4.5)
// Where HP+ = 0, that row and column of P have the type Zero and are not computed with. The
// measurement of a joint is in measurement.hpp, phi P phi' in congruence.hpp.
#pragma once

#include <type_traits>

#include "algorithms/fast/kinematics/sixfold.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// R: type of A's and B's row z, L: of B's and C's column z. Zero where the joint turns, or slides.
template <class T, class R = T, class L = T>
struct Articulated {
  using RL = std::conditional_t<std::is_same_v<R, Zero>, R, L>;

  T Axx, Axy, Ayy;
  R Axz, Ayz, Azz;
  T Bxx, Bxy, Byx, Byy;
  L Bxz, Byz;
  R Bzx, Bzy;
  RL Bzz;
  T Cxx, Cxy, Cyy;
  L Cxz, Cyz, Czz;

  // In line and number by number: a call, or a copy as a whole, would keep P in memory wherever it
  // is used.
  KALMARM_INLINE Articulated<T> full() const {
    return {Axx,         Axy, Ayy, number(Axz), number(Ayz), number(Azz), Bxx,
            Bxy,         Byx, Byy, number(Bxz), number(Byz), number(Bzx), number(Bzy),
            number(Bzz), Cxx, Cxy, Cyy,         number(Cxz), number(Cyz), number(Czz)};
  }

 private:
  KALMARM_INLINE static T number(const T& x) { return x; }
  KALMARM_INLINE static T number(Zero) { return T(0); }
};

// Sizes of the terms that A and C are summed from.
template <class T>
struct Size {
  T moment, force;
};

// M(k).
template <class T, class S>
KALMARM_INLINE void set_body(Articulated<T>& P, const LoweredBody<S>& body) {
  const T zero = T(0), m = T(body.m), hx = T(body.h[0]), hy = T(body.h[1]), hz = T(body.h[2]);
  P = {T(body.Ixx), T(body.Ixy), T(body.Iyy), T(body.Ixz), T(body.Iyz), T(body.Izz), zero,
       -hz,         hz,          zero,        hy,          -hx,         -hy,         hx,
       zero,        m,           zero,        m,           zero,        zero,        m};
}

template <class T, class S>
KALMARM_INLINE void add_body(Articulated<T>& P, const LoweredBody<S>& body) {
  const T m = T(body.m), hx = T(body.h[0]), hy = T(body.h[1]), hz = T(body.h[2]);
  P.Axx += T(body.Ixx);
  P.Axy += T(body.Ixy);
  P.Ayy += T(body.Iyy);
  P.Axz += T(body.Ixz);
  P.Ayz += T(body.Iyz);
  P.Azz += T(body.Izz);
  P.Bxy -= hz;
  P.Byx += hz;
  P.Bxz += hy;
  P.Byz -= hx;
  P.Bzx -= hy;
  P.Bzy += hx;
  P.Cxx += m;
  P.Cyy += m;
  P.Czz += m;
}

template <class T>
KALMARM_INLINE void set_zero(Articulated<T>& P) {
  P.Axx = P.Axy = P.Ayy = P.Axz = P.Ayz = P.Azz = T(0);
  P.Bxx = P.Bxy = P.Byx = P.Byy = P.Bxz = P.Byz = P.Bzx = P.Bzy = P.Bzz = T(0);
  P.Cxx = P.Cxy = P.Cyy = P.Cxz = P.Cyz = P.Czz = T(0);
}

template <class T>
KALMARM_INLINE void add(Articulated<T>& to, const Articulated<T>& from) {
  to.Axx += from.Axx;
  to.Axy += from.Axy;
  to.Ayy += from.Ayy;
  to.Axz += from.Axz;
  to.Ayz += from.Ayz;
  to.Azz += from.Azz;
  to.Bxx += from.Bxx;
  to.Bxy += from.Bxy;
  to.Byx += from.Byx;
  to.Byy += from.Byy;
  to.Bxz += from.Bxz;
  to.Byz += from.Byz;
  to.Bzx += from.Bzx;
  to.Bzy += from.Bzy;
  to.Bzz += from.Bzz;
  to.Cxx += from.Cxx;
  to.Cxy += from.Cxy;
  to.Cyy += from.Cyy;
  to.Cxz += from.Cxz;
  to.Cyz += from.Cyz;
  to.Czz += from.Czz;
}

// P x.
template <class T>
KALMARM_INLINE Sixfold<T> times(const Articulated<T>& P, const Sixfold<T>& x) {
  return {P.Axx * x.x + P.Axy * x.y + P.Axz * x.z + P.Bxx * x.u + P.Bxy * x.v + P.Bxz * x.w,
          P.Axy * x.x + P.Ayy * x.y + P.Ayz * x.z + P.Byx * x.u + P.Byy * x.v + P.Byz * x.w,
          P.Axz * x.x + P.Ayz * x.y + P.Azz * x.z + P.Bzx * x.u + P.Bzy * x.v + P.Bzz * x.w,
          P.Bxx * x.x + P.Byx * x.y + P.Bzx * x.z + P.Cxx * x.u + P.Cxy * x.v + P.Cxz * x.w,
          P.Bxy * x.x + P.Byy * x.y + P.Bzy * x.z + P.Cxy * x.u + P.Cyy * x.v + P.Cyz * x.w,
          P.Bxz * x.x + P.Byz * x.y + P.Bzz * x.z + P.Cxz * x.u + P.Cyz * x.v + P.Czz * x.w};
}

// z += P+ c. A hinge's c has no z, a slide's no moment.
template <class T, class R, class L>
KALMARM_INLINE void add_times(Sixfold<T>& z, const Articulated<T, R, L>& P, const Sixfold<T>& c,
                              bool slides) {
  z.x = z.x + P.Bxx * c.u + P.Bxy * c.v + P.Bxz * c.w;
  z.y = z.y + P.Byx * c.u + P.Byy * c.v + P.Byz * c.w;
  z.z = z.z + (P.Bzx * c.u + P.Bzy * c.v + P.Bzz * c.w);
  z.u = z.u + P.Cxx * c.u + P.Cxy * c.v + P.Cxz * c.w;
  z.v = z.v + P.Cxy * c.u + P.Cyy * c.v + P.Cyz * c.w;
  z.w = z.w + (P.Cxz * c.u + P.Cyz * c.v + P.Czz * c.w);
  if (slides) return;
  z.x = z.x + P.Axx * c.x + P.Axy * c.y;
  z.y = z.y + P.Axy * c.x + P.Ayy * c.y;
  z.z = z.z + (P.Axz * c.x + P.Ayz * c.y);
  z.u = z.u + P.Bxx * c.x + P.Byx * c.y;
  z.v = z.v + P.Bxy * c.x + P.Byy * c.y;
  z.w = z.w + (P.Bxz * c.x + P.Byz * c.y);
}

}  // namespace kalmarm
