// Loads: bodies that a state adds to the robot's, as what a gripper holds, for one state or, with T a Pack, one state
// in every lane.
//
// Of a frame with the pose (A, s) in its link's axes, ten numbers about its origin and in its axes,
//   pi = (m, h_x, h_y, h_z, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz),   h = m c                  (1)
// are about the link's origin and in its axes, with g = A h,
//   m,   g + m s,   A I A' + (2 s'g + m s's) 1 - s g' - g s' - m s s'                       (2)
// and M(k) of the link grows by that. The sum over its children begins with it. With the link's rates w, alpha and
// the acceleration a of its origin it needs there the force
//   F = m a + alpha x h + w x (w x h),   N = I alpha + w x I w + h x a                      (3)
//
// Rounding of (2) is below c u times terms that are in the order of positive semidefinite matrices as those of a
// translation, whose traces of moments and of forces are
//   2 tr I + 2 s's 3 m,   3 m                                                               (4)
// (2) and (4) take 178 flops, (3) 96.
#pragma once

#include <cstddef>

#include "algorithms/fast/kinematics/acting.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// What is added to a link's body: (2), and the traces (4).
template <class T>
struct Load {
  LoweredBody<T> body;
  T moment, force;
};

namespace detail {

// (2) and (4).
template <class T, class S>
KALMARM_NOINLINE Load<T> load_on_link(const LoweredFrame<S>& frame, const T* pi) {
  const T two = T(S(2)), m = pi[0], zero = T(S(0));
  const T I[3][3] = {{pi[4], pi[7], pi[8]}, {pi[7], pi[5], pi[9]}, {pi[8], pi[9], pi[6]}};
  T s[3], g[3], AI[3][3], sum[3][3], sg = zero, ss = zero;
  for (int i = 0; i < 3; ++i) {
    s[i] = T(frame.s[i]);
    g[i] = zero;
    for (int j = 0; j < 3; ++j) g[i] += T(frame.A(i, j)) * pi[1 + j];
    sg += s[i] * g[i];
    ss += s[i] * s[i];
    for (int j = 0; j < 3; ++j) {
      AI[i][j] = zero;
      for (int l = 0; l < 3; ++l) AI[i][j] += T(frame.A(i, l)) * I[l][j];
    }
  }
  const T along = two * sg + m * ss;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) {
      sum[i][j] = i == j ? along : zero;
      for (int l = 0; l < 3; ++l) sum[i][j] += AI[i][l] * T(frame.A(j, l));
      sum[i][j] -= (s[i] * g[j] + g[i] * s[j]) + m * (s[i] * s[j]);
      normalise(sum[i][j]);
    }
  Load<T> out{};
  LoweredBody<T>& body = out.body;
  body.m = m;
  for (int i = 0; i < 3; ++i) body.h[i] = g[i] + m * s[i];
  normalise(body.h[0], body.h[1], body.h[2]);
  body.Ixx = sum[0][0];
  body.Ixy = sum[0][1];
  body.Ixz = sum[0][2];
  body.Iyy = sum[1][1];
  body.Iyz = sum[1][2];
  body.Izz = sum[2][2];
  out.force = T(S(3)) * m;
  out.moment = two * (I[0][0] + I[1][1] + I[2][2]) + two * ss * out.force;
  return out;
}

// use(i, link, load) of every frame i that is loaded.
template <class T, class S, class Use>
void for_each_load(const LoweredModel<S>& model, const Acting<T>& acting, const Use& use) {
  if (!acting.loads) return;
  for (std::size_t i = 0; i < model.loaded().size(); ++i) {
    const LoweredFrame<S>& frame = model.loaded()[i];
    use(i, frame.link, load_on_link(frame, acting.loads + numbers_of_load * i));
  }
}

// (3) is added to z.
template <class T>
KALMARM_NOINLINE void add_force_of_load(const LoweredBody<T>& body, const Triple<T>& w,
                                        const Sixfold<T>& a, Sixfold<T>& z) {
  const Triple<T> h = {body.h[0], body.h[1], body.h[2]};
  const Triple<T> alpha = {a.x, a.y, a.z}, linear = {a.u, a.v, a.w};
  const auto times_I = [&](const Triple<T>& x) {
    return Triple<T>{body.Ixx * x.x + body.Ixy * x.y + body.Ixz * x.z,
                     body.Ixy * x.x + body.Iyy * x.y + body.Iyz * x.z,
                     body.Ixz * x.x + body.Iyz * x.y + body.Izz * x.z};
  };
  const Triple<T> f = cross(alpha, h) + cross(w, cross(w, h));
  const Triple<T> n = times_I(alpha) + cross(w, times_I(w)) + cross(h, linear);
  add(z, Sixfold<T>{n.x, n.y, n.z, body.m * a.u + f.x, body.m * a.v + f.y, body.m * a.w + f.z});
}

}  // namespace detail

}  // namespace kalmarm
