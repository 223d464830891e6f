// (9) of virtual_power.hpp: its S by the ten numbers of bodies and loads, and by forces on frames.
//
// A body has the numbers (m, h_x, h_y, h_z, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz) about the origin of a frame on its link and
// in its axes. Of that frame's origin s, u + mu x s and a + Gamma s are velocity and acceleration. About 190 flops a body.
#pragma once

#include "algorithms/fast/derivatives/virtual_power.hpp"

namespace kalmarm {

namespace detail {

// A' v of a frame's axes A.
template <class T, class S>
KALMARM_INLINE Triple<T> in_axes(const Matrix3<S>& A, const Triple<T>& v) {
  const auto row = [&](int i) { return A(0, i) * v.x + A(1, i) * v.y + A(2, i) * v.z; };
  return {row(0), row(1), row(2)};
}

// u + mu x s of a link.
template <class T, class S>
KALMARM_INLINE Triple<T> velocity_at(const Vector3<S>& s, const Sixfold<T>& u) {
  return linear(u) + cross(angular(u), Triple<T>{T(s[0]), T(s[1]), T(s[2])});
}

}  // namespace detail

// dS by the ten numbers of a body on frame (A, s) of a link that moves so: ten.
template <class T, class S>
KALMARM_NOINLINE void body_adjoints(const Matrix3<S>& A, const Vector3<S>& s,
                                    const typename VirtualPowerWorkspace<T>::Motion& at, T* out) {
  AccelerationGradient<T> G;
  detail::set_gradient(at.w.x, at.w.y, at.w.z, at.a, G);
  const Triple<T> mu = detail::angular(at.u), u = detail::velocity_at(s, at.u);
  const Triple<T> x = {G.xx, G.yx, G.zx}, y = {G.xy, G.yy, G.zy}, z = {G.xz, G.yz, G.zz};
  const Triple<T> a = detail::linear(at.a) + s[0] * x + s[1] * y + s[2] * z;
  out[0] = dot(u, a);
  const Triple<T> h = detail::in_axes(A, Triple<T>{dot(x, u), dot(y, u), dot(z, u)} + cross(a, mu));
  out[1] = h.x;
  out[2] = h.y;
  out[3] = h.z;
  // Q = tr K / 2 - (K + K') / 2, of which the columns of K = mu~'Gamma are Gamma's x mu.
  const Triple<T> Kx = cross(x, mu), Ky = cross(y, mu), Kz = cross(z, mu);
  const T half = T(S(0.5));
  const T xx = half * (Ky.y + Kz.z - Kx.x), yy = half * (Kx.x + Kz.z - Ky.y),
          zz = half * (Kx.x + Ky.y - Kz.z), xy = -half * (Kx.y + Ky.x), xz = -half * (Kx.z + Kz.x),
          yz = -half * (Ky.z + Kz.y);
  Triple<T> QA[3];  // columns of Q A, then of A'Q A
  for (int j = 0; j < 3; ++j) {
    const S a_x = A(0, j), a_y = A(1, j), a_z = A(2, j);
    QA[j] = detail::in_axes(
        A, a_x * Triple<T>{xx, xy, xz} + a_y * Triple<T>{xy, yy, yz} + a_z * Triple<T>{xz, yz, zz});
  }
  out[4] = QA[0].x;
  out[5] = QA[1].y;
  out[6] = QA[2].z;
  out[7] = QA[0].y + QA[0].y;
  out[8] = QA[0].z + QA[0].z;
  out[9] = QA[1].z + QA[1].z;
}

// dS by a force (n; f) in the axes of frame (A, s) of a link that moves so: six.
template <class T, class S>
KALMARM_NOINLINE void force_adjoints(const Matrix3<S>& A, const Vector3<S>& s,
                                     const typename VirtualPowerWorkspace<T>::Motion& at, T* out) {
  const Triple<T> n = detail::in_axes(A, detail::angular(at.u)),
                  f = detail::in_axes(A, detail::velocity_at(s, at.u));
  out[0] = -n.x;
  out[1] = -n.y;
  out[2] = -n.z;
  out[3] = -f.x;
  out[4] = -f.y;
  out[5] = -f.z;
}

}  // namespace kalmarm
