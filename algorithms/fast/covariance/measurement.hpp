// The measurement of one joint by the conventional form: P- becomes P+ (articulated.hpp).
//
//   D = HP-H' + r,  g = P-H' / D                                          (3.6), (3.10)
//   P+ = P- - g (P-H')'                                                   (3.6)
// H selects row z of A and B at a hinge, of B' and C at a slide. Where r = 0, HP+ = 0: that row and
// column have the type Zero. Where r > 0, HP+ = r g'. 36 flops without noise.
#pragma once

#include <type_traits>

#include "algorithms/fast/covariance/articulated.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// A hinge: D is returned, g written; g.z is 1 and left alone where there is no noise.
template <bool noise, class T, class S>
KALMARM_INLINE auto measure_turn(const Articulated<T>& P, const S& r, T& D, T& inverse_D,
                                 Sixfold<T>& g) {
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
KALMARM_INLINE auto measure_slide(const Articulated<T>& P, const S& r, T& D, T& inverse_D,
                                  Sixfold<T>& g) {
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

}  // namespace kalmarm
