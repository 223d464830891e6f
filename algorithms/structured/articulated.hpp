// The articulated inertia of the fast path: P of the conventional form (riccati/conventional.hpp)
// as 21 numbers, P = [A B; B' C] with A and C symmetric.
//
//   D = HP-H' + r,  g = P-H' / D                                          (3.6), (3.10)
//   P+ = P- - g (P-H')'                                                   (3.6)
//   P-(parent) += phi P+ phi',  phi = T(p) Rz(theta) Rx(alpha) Rz(angle) Tz(d)
// With r = 0 is HP+ = 0: that row and column have the type Zero and are not computed, here and in
// what follows, until Rx fills them. Where r > 0, HP+ = r g'.
//   Rz: a vector turns by (c, s). Of a block of two axes only half the difference of the diagonal
//       and half the sum off it turn, by twice the angle; with h = xx - yy, u = xy + yx that is
//       xx - delta, yy + delta, xy + epsilon, yx + epsilon,
//       delta = s^2 h + sc u,  epsilon = sc h - s^2 u
//   T:  B <- B + p~C,  A <- A + p~B' + B p~' with the old B and the new one, one axis at a time
// 36 flops for the joint, 130 for phi at an heir's hinge, 15 to add a body.
#pragma once

#include <type_traits>

#include "algorithms/structured/structured_model.hpp"

namespace kalmarm {

// A number that is known to be zero: terms with it vanish when they are compiled.
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
[[gnu::always_inline]] inline void add(Sixfold<T>& a, const Sixfold<T>& b) {
  a.x += b.x;
  a.y += b.y;
  a.z += b.z;
  a.u += b.u;
  a.v += b.v;
  a.w += b.w;
}

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
  [[gnu::always_inline]] Articulated<T> full() const {
    return {Axx,         Axy, Ayy, number(Axz), number(Ayz), number(Azz), Bxx,
            Bxy,         Byx, Byy, number(Bxz), number(Byz), number(Bzx), number(Bzy),
            number(Bzz), Cxx, Cxy, Cyy,         number(Cxz), number(Cyz), number(Czz)};
  }

 private:
  [[gnu::always_inline]] static T number(const T& x) { return x; }
  [[gnu::always_inline]] static T number(Zero) { return T(0); }
};

// Sizes of the terms that A and C are summed from.
template <class T>
struct Size {
  T moment, force;
};

// M(k).
template <class T, class S>
[[gnu::always_inline]] inline void set_body(const StructuredBody<S>& body, Articulated<T>& P) {
  const T zero = T(0), m = T(body.m), hx = T(body.h[0]), hy = T(body.h[1]), hz = T(body.h[2]);
  P = {T(body.Ixx), T(body.Ixy), T(body.Iyy), T(body.Ixz), T(body.Iyz), T(body.Izz), zero,
       -hz,         hz,          zero,        hy,          -hx,         -hy,         hx,
       zero,        m,           zero,        m,           zero,        zero,        m};
}

template <class T, class S>
[[gnu::always_inline]] inline void add_body(const StructuredBody<S>& body, Articulated<T>& P) {
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
[[gnu::always_inline]] inline void add(Articulated<T>& P, const Articulated<T>& Q) {
  P.Axx += Q.Axx;
  P.Axy += Q.Axy;
  P.Ayy += Q.Ayy;
  P.Axz += Q.Axz;
  P.Ayz += Q.Ayz;
  P.Azz += Q.Azz;
  P.Bxx += Q.Bxx;
  P.Bxy += Q.Bxy;
  P.Byx += Q.Byx;
  P.Byy += Q.Byy;
  P.Bxz += Q.Bxz;
  P.Byz += Q.Byz;
  P.Bzx += Q.Bzx;
  P.Bzy += Q.Bzy;
  P.Bzz += Q.Bzz;
  P.Cxx += Q.Cxx;
  P.Cxy += Q.Cxy;
  P.Cyy += Q.Cyy;
  P.Cxz += Q.Cxz;
  P.Cyz += Q.Cyz;
  P.Czz += Q.Czz;
}

// A hinge: D is returned, g written; g.z is 1 and left alone where there is no noise.
template <bool noise, class T, class S>
[[gnu::always_inline]] inline auto measure_turn(const Articulated<T>& P, const S& r, T& D,
                                                T& inverse_D, Sixfold<T>& g) {
  D = P.Azz;
  if constexpr (noise) D += T(r);
  inverse_D = T(1) / D;
  g.x = P.Axz * inverse_D;
  g.y = P.Ayz * inverse_D;
  g.u = P.Bzx * inverse_D;
  g.v = P.Bzy * inverse_D;
  g.w = P.Bzz * inverse_D;
  Articulated<T, std::conditional_t<noise, T, Zero>> out;
  out.Axx = P.Axx - g.x * P.Axz;
  out.Axy = P.Axy - g.x * P.Ayz;
  out.Ayy = P.Ayy - g.y * P.Ayz;
  out.Bxx = P.Bxx - g.x * P.Bzx;
  out.Bxy = P.Bxy - g.x * P.Bzy;
  out.Bxz = P.Bxz - g.x * P.Bzz;
  out.Byx = P.Byx - g.y * P.Bzx;
  out.Byy = P.Byy - g.y * P.Bzy;
  out.Byz = P.Byz - g.y * P.Bzz;
  out.Cxx = P.Cxx - g.u * P.Bzx;
  out.Cxy = P.Cxy - g.u * P.Bzy;
  out.Cyy = P.Cyy - g.v * P.Bzy;
  out.Cxz = P.Cxz - g.u * P.Bzz;
  out.Cyz = P.Cyz - g.v * P.Bzz;
  out.Czz = P.Czz - g.w * P.Bzz;
  if constexpr (noise) {
    g.z = P.Azz * inverse_D;
    out.Axz = T(r) * g.x;
    out.Ayz = T(r) * g.y;
    out.Azz = T(r) * g.z;
    out.Bzx = T(r) * g.u;
    out.Bzy = T(r) * g.v;
    out.Bzz = T(r) * g.w;
  }
  return out;
}

// A slide; g.w is 1 and left alone where there is no noise.
template <bool noise, class T, class S>
[[gnu::always_inline]] inline auto measure_slide(const Articulated<T>& P, const S& r, T& D,
                                                 T& inverse_D, Sixfold<T>& g) {
  D = P.Czz;
  if constexpr (noise) D += T(r);
  inverse_D = T(1) / D;
  g.x = P.Bxz * inverse_D;
  g.y = P.Byz * inverse_D;
  g.z = P.Bzz * inverse_D;
  g.u = P.Cxz * inverse_D;
  g.v = P.Cyz * inverse_D;
  Articulated<T, T, std::conditional_t<noise, T, Zero>> out;
  out.Axx = P.Axx - g.x * P.Bxz;
  out.Axy = P.Axy - g.x * P.Byz;
  out.Ayy = P.Ayy - g.y * P.Byz;
  out.Axz = P.Axz - g.x * P.Bzz;
  out.Ayz = P.Ayz - g.y * P.Bzz;
  out.Azz = P.Azz - g.z * P.Bzz;
  out.Bxx = P.Bxx - g.x * P.Cxz;
  out.Bxy = P.Bxy - g.x * P.Cyz;
  out.Byx = P.Byx - g.y * P.Cxz;
  out.Byy = P.Byy - g.y * P.Cyz;
  out.Bzx = P.Bzx - g.z * P.Cxz;
  out.Bzy = P.Bzy - g.z * P.Cyz;
  out.Cxx = P.Cxx - g.u * P.Cxz;
  out.Cxy = P.Cxy - g.u * P.Cyz;
  out.Cyy = P.Cyy - g.v * P.Cyz;
  if constexpr (noise) {
    g.w = P.Czz * inverse_D;
    out.Bxz = T(r) * g.x;
    out.Byz = T(r) * g.y;
    out.Bzz = T(r) * g.z;
    out.Cxz = T(r) * g.u;
    out.Cyz = T(r) * g.v;
    out.Czz = T(r) * g.w;
  }
  return out;
}

// (x, y) turned by (c, s), and back.
template <class T, class X, class Y, class C>
[[gnu::always_inline]] inline void turn(const Direction<C>& by, const X& x, const Y& y, T& out_x,
                                        T& out_y) {
  const T new_x = by.c * x - by.s * y;
  out_y = by.s * x + by.c * y;
  out_x = new_x;
}
template <class T, class C>
[[gnu::always_inline]] inline void turn_back(const Direction<C>& by, T& x, T& y) {
  const T new_x = by.c * x + by.s * y;
  y = by.c * y - by.s * x;
  x = new_x;
}
template <class C>
[[gnu::always_inline]] inline void turn(const Direction<C>&, Zero, Zero, Zero&, Zero&) {}

// A block of two axes, and a symmetric one. Functions, since gcc does not inline every lambda where
// a file has much else.
template <class C, class T>
[[gnu::always_inline]] inline void turn_tensor(const Turn<C>& by, T& xx, T& xy, T& yx, T& yy) {
  const T h = xx - yy, u = xy + yx;
  const T delta = by.ss * h + by.cs * u, epsilon = by.cs * h - by.ss * u;
  xx -= delta;
  yy += delta;
  xy += epsilon;
  yx += epsilon;
}
template <class C, class T>
[[gnu::always_inline]] inline void turn_symmetric(const Turn<C>& by, T& xx, T& xy, T& yy) {
  const T h = xx - yy, u = xy + xy;
  const T delta = by.ss * h + by.cs * u;
  xy += by.cs * h - by.ss * u;
  xx -= delta;
  yy += delta;
}

// Rz P Rz'. 46 flops with a row of zeros.
template <class T, class R, class L, class C>
[[gnu::always_inline]] inline void rotate_z(const Turn<C>& by, Articulated<T, R, L>& P) {
  turn_symmetric(by, P.Axx, P.Axy, P.Ayy);
  turn_tensor(by, P.Bxx, P.Bxy, P.Byx, P.Byy);
  turn_symmetric(by, P.Cxx, P.Cxy, P.Cyy);
  turn(by, P.Axz, P.Ayz, P.Axz, P.Ayz);
  turn(by, P.Bxz, P.Byz, P.Bxz, P.Byz);
  turn(by, P.Bzx, P.Bzy, P.Bzx, P.Bzy);
  turn(by, P.Cxz, P.Cyz, P.Cxz, P.Cyz);
}

// Rx P Rx', which fills the row of zeros. 38 flops from one.
template <class T, class R, class L, class C>
[[gnu::always_inline]] inline Articulated<T> rotate_x(const Turn<C>& by,
                                                      const Articulated<T, R, L>& P) {
  Articulated<T> out;
  out.Axx = P.Axx;
  out.Bxx = P.Bxx;
  out.Cxx = P.Cxx;
  turn(by, P.Axy, P.Axz, out.Axy, out.Axz);
  turn(by, P.Bxy, P.Bxz, out.Bxy, out.Bxz);
  turn(by, P.Byx, P.Bzx, out.Byx, out.Bzx);
  turn(by, P.Cxy, P.Cxz, out.Cxy, out.Cxz);
  {
    const T h = P.Ayy - P.Azz;
    const auto u = P.Ayz + P.Ayz;
    const T delta = by.ss * h + by.cs * u;
    out.Ayy = P.Ayy - delta;
    out.Azz = P.Azz + delta;
    out.Ayz = P.Ayz + (by.cs * h - by.ss * u);
  }
  {
    const T h = P.Byy - P.Bzz, u = P.Byz + P.Bzy;
    const T delta = by.ss * h + by.cs * u, epsilon = by.cs * h - by.ss * u;
    out.Byy = P.Byy - delta;
    out.Bzz = P.Bzz + delta;
    out.Byz = P.Byz + epsilon;
    out.Bzy = P.Bzy + epsilon;
  }
  {
    const T h = P.Cyy - P.Czz;
    const auto u = P.Cyz + P.Cyz;
    const T delta = by.ss * h + by.cs * u;
    out.Cyy = P.Cyy - delta;
    out.Czz = P.Czz + delta;
    out.Cyz = P.Cyz + (by.cs * h - by.ss * u);
  }
  return out;
}

// The same by a right angle, from which no flop is left: (x, y, z) becomes (x, -z, y).
template <class T>
[[gnu::always_inline]] inline Articulated<T> rotate_x_right(const Articulated<T>& P) {
  return {P.Axx,  -P.Axz, P.Azz,  P.Axy, -P.Ayz, P.Ayy,  P.Bxx, -P.Bxz, -P.Bzx, P.Bzz, P.Bxy,
          -P.Bzy, P.Byx,  -P.Byz, P.Byy, P.Cxx,  -P.Cxz, P.Czz, P.Cxy,  -P.Cyz, P.Cyy};
}

// T(0,0,d). 21 flops with row z of zeros.
template <class T, class R, class L, class D>
[[gnu::always_inline]] inline void translate_z(const D& d, Articulated<T, R, L>& P) {
  const T Bxy = P.Bxy, Byx = P.Byx, Byy = P.Byy;
  P.Bxx = P.Bxx - d * P.Cxy;
  P.Bxy = P.Bxy - d * P.Cyy;
  P.Bxz = P.Bxz - d * P.Cyz;
  P.Byx = P.Byx + d * P.Cxx;
  P.Byy = P.Byy + d * P.Cxy;
  P.Byz = P.Byz + d * P.Cxz;
  P.Axx = P.Axx - d * (Bxy + P.Bxy);
  P.Axy = P.Axy + d * (P.Bxx - Byy);
  P.Ayy = P.Ayy + d * (Byx + P.Byx);
  P.Axz = P.Axz - d * P.Bzy;
  P.Ayz = P.Ayz + d * P.Bzx;
}

// T(a,0,0). 25 flops.
template <class T, class D>
[[gnu::always_inline]] inline void translate_x(const D& a, Articulated<T>& P) {
  const T Byz = P.Byz, Bzy = P.Bzy, Bzz = P.Bzz;
  P.Byx = P.Byx - a * P.Cxz;
  P.Byy = P.Byy - a * P.Cyz;
  P.Byz = P.Byz - a * P.Czz;
  P.Bzx = P.Bzx + a * P.Cxy;
  P.Bzy = P.Bzy + a * P.Cyy;
  P.Bzz = P.Bzz + a * P.Cyz;
  P.Ayy = P.Ayy - a * (Byz + P.Byz);
  P.Ayz = P.Ayz + a * (P.Byy - Bzz);
  P.Azz = P.Azz + a * (Bzy + P.Bzy);
  P.Axy = P.Axy - a * P.Bxz;
  P.Axz = P.Axz + a * P.Bxy;
}

// T(0,b,0). 25 flops.
template <class T, class D>
[[gnu::always_inline]] inline void translate_y(const D& b, Articulated<T>& P) {
  const T Bzx = P.Bzx, Bxz = P.Bxz, Bxx = P.Bxx;
  P.Bzx = P.Bzx - b * P.Cxx;
  P.Bzy = P.Bzy - b * P.Cxy;
  P.Bzz = P.Bzz - b * P.Cxz;
  P.Bxx = P.Bxx + b * P.Cxz;
  P.Bxy = P.Bxy + b * P.Cyz;
  P.Bxz = P.Bxz + b * P.Czz;
  P.Azz = P.Azz - b * (Bzx + P.Bzx);
  P.Axz = P.Axz + b * (P.Bzz - Bxx);
  P.Axx = P.Axx + b * (Bxz + P.Bxz);
  P.Ayz = P.Ayz - b * P.Byx;
  P.Axy = P.Axy + b * P.Byz;
}

template <class T>
struct Rotation {
  T R[3][3];
};

// R X R'. 90 flops.
template <class T>
void conjugate(const Rotation<T>& by, const T (&X)[3][3], T (&out)[3][3]) {
  T RX[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      RX[i][j] = by.R[i][0] * X[0][j] + by.R[i][1] * X[1][j] + by.R[i][2] * X[2][j];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      out[i][j] = RX[i][0] * by.R[j][0] + RX[i][1] * by.R[j][1] + RX[i][2] * by.R[j][2];
}

// R P R' of any rotation. 270 flops.
template <class T>
void rotate(const Rotation<T>& by, Articulated<T>& P) {
  T A[3][3], B[3][3], C[3][3];
  conjugate(by, {{P.Axx, P.Axy, P.Axz}, {P.Axy, P.Ayy, P.Ayz}, {P.Axz, P.Ayz, P.Azz}}, A);
  conjugate(by, {{P.Bxx, P.Bxy, P.Bxz}, {P.Byx, P.Byy, P.Byz}, {P.Bzx, P.Bzy, P.Bzz}}, B);
  conjugate(by, {{P.Cxx, P.Cxy, P.Cxz}, {P.Cxy, P.Cyy, P.Cyz}, {P.Cxz, P.Cyz, P.Czz}}, C);
  P = {A[0][0], A[0][1], A[1][1], A[0][2], A[1][2], A[2][2], B[0][0],
       B[0][1], B[1][0], B[1][1], B[0][2], B[1][2], B[2][0], B[2][1],
       B[2][2], C[0][0], C[0][1], C[1][1], C[0][2], C[1][2], C[2][2]};
}

// The follower's phi: (x, y, z) of the link are (y, z, x) of its parent.
template <class T>
Articulated<T> cycle(const Articulated<T>& P) {
  return {P.Azz, P.Axz, P.Axx, P.Ayz, P.Axy, P.Ayy, P.Bzz, P.Bzx, P.Bxz, P.Bxx, P.Bzy,
          P.Bxy, P.Byz, P.Byx, P.Byy, P.Czz, P.Cxz, P.Cxx, P.Cyz, P.Cxy, P.Cyy};
}
template <class T>
[[gnu::always_inline]] inline Sixfold<T> cycle(const Sixfold<T>& z) {
  return {z.z, z.x, z.y, z.w, z.u, z.v};
}

// P x.
template <class T>
[[gnu::always_inline]] inline Sixfold<T> times(const Articulated<T>& P, const Sixfold<T>& x) {
  return {P.Axx * x.x + P.Axy * x.y + P.Axz * x.z + P.Bxx * x.u + P.Bxy * x.v + P.Bxz * x.w,
          P.Axy * x.x + P.Ayy * x.y + P.Ayz * x.z + P.Byx * x.u + P.Byy * x.v + P.Byz * x.w,
          P.Axz * x.x + P.Ayz * x.y + P.Azz * x.z + P.Bzx * x.u + P.Bzy * x.v + P.Bzz * x.w,
          P.Bxx * x.x + P.Byx * x.y + P.Bzx * x.z + P.Cxx * x.u + P.Cxy * x.v + P.Cxz * x.w,
          P.Bxy * x.x + P.Byy * x.y + P.Bzy * x.z + P.Cxy * x.u + P.Cyy * x.v + P.Cyz * x.w,
          P.Bxz * x.x + P.Byz * x.y + P.Bzz * x.z + P.Cxz * x.u + P.Cyz * x.v + P.Czz * x.w};
}

// P+ c. A hinge's c has no z, a slide's no moment.
template <class T, class R, class L>
[[gnu::always_inline]] inline void add_times(const Articulated<T, R, L>& P, const Sixfold<T>& c,
                                             bool slides, Sixfold<T>& z) {
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
