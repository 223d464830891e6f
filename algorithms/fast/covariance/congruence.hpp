// Congruence transforms of P (articulated.hpp), factor by factor of phi.
//
//   P-(parent) += phi P+ phi',  phi = T(p) Rz(theta) Rx(alpha) Rz(angle) Tz(d)           (3.6)
//   Rz: a vector turns by (c, s). Of a block of two axes only half the difference of the diagonal
//       and half the sum off it turn, by twice the angle; with h = xx - yy, u = xy + yx that is
//       xx - delta, yy + delta, xy + epsilon, yx + epsilon,
//       delta = s^2 h + sc u,  epsilon = sc h - s^2 u
//   T:  B <- B + p~C,  A <- A + p~B' + B p~' with the old B and the new one, one axis at a time
// A row and a column of zeros, which the measurement leaves, stay so until Rx fills them. 130 flops
// for phi of a hinge whose theta = 0 and p = (a, 0, 0).
#pragma once

#include "algorithms/fast/covariance/articulated.hpp"
#include "algorithms/fast/kinematics/moves.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// Of rows that are known to be zero.
template <class C>
KALMARM_INLINE void turn(const Direction<C>&, Zero, Zero, Zero&, Zero&) {}

// A block of two axes, and a symmetric one. Functions, since gcc does not inline every lambda where
// a file has much else.
template <class C, class T>
KALMARM_INLINE void turn_tensor(const Turn<C>& by, T& xx, T& xy, T& yx, T& yy) {
  const T h = xx - yy, u = xy + yx;
  const T delta = by.ss * h + by.cs * u, epsilon = by.cs * h - by.ss * u;
  xx -= delta;
  yy += delta;
  xy += epsilon;
  yx += epsilon;
}
template <class C, class T>
KALMARM_INLINE void turn_symmetric(const Turn<C>& by, T& xx, T& xy, T& yy) {
  const T h = xx - yy, u = xy + xy;
  const T delta = by.ss * h + by.cs * u;
  xy += by.cs * h - by.ss * u;
  xx -= delta;
  yy += delta;
}

// Rz P Rz'. 46 flops with a row of zeros.
template <class T, class R, class L, class C>
KALMARM_INLINE void rotate_z(const Turn<C>& by, Articulated<T, R, L>& P) {
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
KALMARM_INLINE Articulated<T> rotate_x(const Turn<C>& by, const Articulated<T, R, L>& P) {
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
KALMARM_INLINE Articulated<T> rotate_x_right(const Articulated<T>& P) {
  return {P.Axx,  -P.Axz, P.Azz,  P.Axy, -P.Ayz, P.Ayy,  P.Bxx, -P.Bxz, -P.Bzx, P.Bzz, P.Bxy,
          -P.Bzy, P.Byx,  -P.Byz, P.Byy, P.Cxx,  -P.Cxz, P.Czz, P.Cxy,  -P.Cyz, P.Cyy};
}

// T(0,0,d). 21 flops with row z of zeros.
template <class T, class R, class L, class D>
KALMARM_INLINE void translate_z(const D& d, Articulated<T, R, L>& P) {
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
KALMARM_INLINE void translate_x(const D& a, Articulated<T>& P) {
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
KALMARM_INLINE void translate_y(const D& b, Articulated<T>& P) {
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

}  // namespace kalmarm
