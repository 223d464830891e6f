// Ball and free joints in one block step, where their DoF have no joint noise and no body between
// them.
//
// The three axes of a ball joint are the link's own z, y and x, tips to base. Measured one after
// another they leave of P = [A B; B' C] nothing but C:
//   D_z = Azz,  g_z = (Axz, Ayz; Bz.) / D_z,  A, B and C less g_z times that row      (3.6), (3.10)
//   D_y = Ayy,  g_y = (Axy; By.) / D_y,       Axx, Bx. and C less g_y times that row
//   D_x = Axx,  g_x = (Bx.) / D_x,            C+ = C - g_x Bx.
//   P+(parent) = phi [0 0; 0 R C+ R'] phi'
// The three slides of a free joint likewise take all of C, and nothing is left: P+ = 0.
// The axes are fixed in the body, so the velocity-product acceleration is one term of the joint,
//   c = (u x q'; 2 u x q' + centripetal),  u = R'w(parent)             of forward_dynamics.hpp
// stored at its first DoF; that of the others is zero (LinkRun::at_once). About 180 flops a free
// joint for P, where six joints of one DoF take 560.
#pragma once

#include <algorithm>

#include "algorithms/fast/covariance/rounding_test.hpp"
#include "algorithms/fast/covariance/transforms.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// P of forces alone: [0 0; 0 C].
template <class T>
struct Translational {
  T xx, xy, yy, xz, yz, zz;

  // Less g u', g = u / D.
  void subtract(const T& gx, const T& gy, const T& gz, const T& ux, const T& uy, const T& uz) {
    xx -= gx * ux;
    xy -= gx * uy;
    yy -= gy * uy;
    xz -= gx * uz;
    yz -= gy * uz;
    zz -= gz * uz;
  }
};

namespace detail {

// z += P+ c.
template <class T>
KALMARM_INLINE void add_times(Sixfold<T>& z, const Translational<T>& C, const Sixfold<T>& c, bool) {
  z.u += C.xx * c.u + C.xy * c.v + C.xz * c.w;
  z.v += C.xy * c.u + C.yy * c.v + C.yz * c.w;
  z.w += C.xz * c.u + C.yz * c.v + C.zz * c.w;
}
// Where c is zero, or P+ is.
template <class T>
void add_times(Sixfold<T>&, Zero, const Sixfold<T>&, bool) {}

// R C R'. 75 flops.
template <class T>
Translational<T> rotate(const Rotation<T>& by, const Translational<T>& C) {
  T RC[3][3];
  const auto& R = by.R;
  for (int i = 0; i < 3; ++i) {
    RC[i][0] = R[i][0] * C.xx + R[i][1] * C.xy + R[i][2] * C.xz;
    RC[i][1] = R[i][0] * C.xy + R[i][1] * C.yy + R[i][2] * C.yz;
    RC[i][2] = R[i][0] * C.xz + R[i][1] * C.yz + R[i][2] * C.zz;
  }
  const auto entry = [&](int i, int j) {
    return RC[i][0] * R[j][0] + RC[i][1] * R[j][1] + RC[i][2] * R[j][2];
  };
  return {entry(0, 0), entry(0, 1), entry(1, 1), entry(0, 2), entry(1, 2), entry(2, 2)};
}

// The slides of a free joint, whose last DoF is k: z- becomes z+ of its first DoF. 27 flops for P.
template <class T, class S, class Workspace, class Load, class Policy>
KALMARM_INLINE void cross_slides(int k, Workspace& ws, const Translational<T>& C, Load& z,
                                 const Policy& policy) {
  const T zero = T(S(0)), one = T(S(1));
  const auto measured = [&](int dof, const T& inverse_D, const Sixfold<T>& g)
                            KALMARM_INLINE_LAMBDA {
                              ws.links[dof].g = g;
                              policy.template measured<true, false>(dof, g, inverse_D, Zero{}, z);
                            };

  T inverse_D = one / C.zz;
  Sixfold<T> g = {zero, zero, zero, C.xz * inverse_D, C.yz * inverse_D, one};
  measured(k, inverse_D, g);
  const T xx = C.xx - g.u * C.xz, xy = C.xy - g.u * C.yz, yy = C.yy - g.v * C.yz;

  policy.cycle(z);
  inverse_D = one / yy;
  g = {zero, zero, zero, zero, xy * inverse_D, one};
  measured(k - 1, inverse_D, g);
  const T left = xx - g.v * xy;

  policy.cycle(z);
  measured(k - 2, one / left, {zero, zero, zero, zero, zero, one});
}

// The axes of a ball joint, whose last DoF is k: C+ in the frame of its first, and z+ there.
template <class T, class S, class Workspace, class Load, class Policy>
KALMARM_INLINE Translational<T> cross_turns(int k, Workspace& ws, const Articulated<T>& P, Load& z,
                                            const Policy& policy) {
  const T zero = T(S(0)), one = T(S(1));
  const auto measured = [&](int dof, const T& inverse_D, const Sixfold<T>& g, const auto& P_plus)
                            KALMARM_INLINE_LAMBDA {
                              ws.links[dof].g = g;
                              policy.template measured<false, false>(dof, g, inverse_D, P_plus, z);
                            };

  T inverse_D = one / P.Azz;
  Sixfold<T> g = {P.Axz * inverse_D, P.Ayz * inverse_D, one,
                  P.Bzx * inverse_D, P.Bzy * inverse_D, P.Bzz * inverse_D};
  measured(k, inverse_D, g, Zero{});
  const T Axx = P.Axx - g.x * P.Axz, Axy = P.Axy - g.x * P.Ayz, Ayy = P.Ayy - g.y * P.Ayz;
  T Bxx = P.Bxx - g.x * P.Bzx, Bxy = P.Bxy - g.x * P.Bzy, Bxz = P.Bxz - g.x * P.Bzz;
  const T Byx = P.Byx - g.y * P.Bzx, Byy = P.Byy - g.y * P.Bzy, Byz = P.Byz - g.y * P.Bzz;
  Translational<T> C = {P.Cxx, P.Cxy, P.Cyy, P.Cxz, P.Cyz, P.Czz};
  C.subtract(g.u, g.v, g.w, P.Bzx, P.Bzy, P.Bzz);

  policy.cycle(z);  // the link's (z, x, y)
  inverse_D = one / Ayy;
  g = {zero, Axy * inverse_D, one, Byz * inverse_D, Byx * inverse_D, Byy * inverse_D};
  measured(k - 1, inverse_D, g, Zero{});
  const T left = Axx - g.y * Axy;
  Bxx -= g.y * Byx;
  Bxy -= g.y * Byy;
  Bxz -= g.y * Byz;
  C.subtract(g.v, g.w, g.u, Byx, Byy, Byz);

  policy.cycle(z);  // the link's (y, z, x)
  inverse_D = one / left;
  g = {zero, zero, one, Bxy * inverse_D, Bxz * inverse_D, Bxx * inverse_D};
  C.subtract(g.w, g.u, g.v, Bxx, Bxy, Bxz);
  C = {C.yy, C.yz, C.zz, C.xy, C.xz, C.xx};
  measured(k - 2, inverse_D, g, C);
  return C;
}

// Across the joint of a run: g of every DoF is kept; P- becomes P+ in the parent's frame, z
// likewise. Rounding leaves the zeros of P+ alone, so that the link's body absorbs the errors of
// all steps or none (rounding_test.hpp).
template <class T, class S, class Workspace, class Load, class Policy>
void cross_at_once(const LoweredModel<S>& model, const LinkRun& run, Workspace& ws,
                   Articulated<T>& P, HandedOn<T>& pending, Load& z, const Policy& policy) {
  using std::min;
  const T zero = T(S(0));
  const int ball = run.last - 2;
  const auto& weights = model.body(run.last).weights;
  if (weights.tested)
    ws.margin = min(ws.margin,
                    T(T(S(1)) - (absorbed<false>(weights, P, zero) + absorbed(weights, pending))));
  pending = HandedOn<T>::none();
  Translational<T> C = cross_turns<T, S>(run.last, ws, P, z, policy);
  if (run.first < ball) {
    const auto& phi = ws.matrices[model.link(ball).varying];
    C = rotate(phi.R, C);
    policy.to_parent(phi, z);
    cross_slides<T, S>(ball - 1, ws, C, z, policy);
    C = {zero, zero, zero, zero, zero, zero};
  }
  const LoweredLink<S>& first = model.link(run.first);
  if (first.parent < 0) return;
  const auto& phi = ws.matrices[first.varying];
  C = rotate(phi.R, C);
  policy.to_parent(phi, z);
  P = {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero,
       zero, zero, zero, zero, C.xx, C.xy, C.yy, C.xz, C.yz, C.zz};
  const auto& p = phi.p;
  translate_x(p[0], P);
  translate_y(p[1], P);
  translate_z(p[2], P);
}

}  // namespace detail

}  // namespace kalmarm
