// phi(parent,k) of the fast path at work: on forces, motions and velocities, for a placement by
// screws (lowered_model.hpp) and for one by a matrix that depends on the state.
//
//   x+ -> phi x+:  moment + p x force;   l -> phi' l:  v - p x w
//   w -> R'w, and the acceleration that turning brings to the link's origin,
//   c = R'W p + d W e_z,  W x = w (w'x) - x w'w       W of the parent, then in the link's axes
// Rx(alpha) of parallel axes, and of axes at a right angle, takes no flop.
#pragma once

#include "algorithms/fast/kinematics/sixfold.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class T>
struct Rotation {
  T R[3][3];
};

template <class T>
struct MatrixPlacement {
  Rotation<T> R;
  T p[3];
};

namespace detail {

// Rx(alpha) of (y, z), and back. A right angle costs nothing.
template <class T, class S>
KALMARM_INLINE void tilt(const LoweredLink<S>& link, T& y, T& z) {
  using Tilt = typename LoweredLink<S>::Tilt;
  if (link.tilt == Tilt::right) {
    const T old = y;
    y = -z;
    z = old;
  } else if (link.tilt == Tilt::any) {
    turn(link.alpha, y, z, y, z);
  }
}
template <class T, class S>
KALMARM_INLINE void tilt_back(const LoweredLink<S>& link, T& y, T& z) {
  using Tilt = typename LoweredLink<S>::Tilt;
  if (link.tilt == Tilt::right) {
    const T old = y;
    y = z;
    z = -old;
  } else if (link.tilt == Tilt::any) {
    turn_back(link.alpha, y, z);
  }
}

// phi x of a link on a hinge or slide.
template <class T, class S, class C, class D>
KALMARM_INLINE void force_to_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                    const Direction<C>& joint, const D& d, Sixfold<T>& z) {
  z.x = z.x - d * z.v;
  z.y = z.y + d * z.u;
  turn(joint, z.x, z.y, z.x, z.y);
  turn(joint, z.u, z.v, z.u, z.v);
  tilt(link, z.y, z.z);
  tilt(link, z.v, z.w);
  if (link.turned) {
    turn(model.uncommon(link).theta, z.x, z.y, z.x, z.y);
    turn(model.uncommon(link).theta, z.u, z.v, z.u, z.v);
  }
  z.y = z.y - link.p[0] * z.w;
  z.z = z.z + link.p[0] * z.v;
  if (link.p[1] != S(0)) {
    z.z = z.z - link.p[1] * z.u;
    z.x = z.x + link.p[1] * z.w;
  }
  if (link.p[2] != S(0)) {
    z.x = z.x - link.p[2] * z.v;
    z.y = z.y + link.p[2] * z.u;
  }
}

// phi' l; `moved` or not: without what its translation does, both halves are turned alone.
template <bool moved = true, class T, class S, class C, class D>
KALMARM_INLINE void motion_from_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                       const Direction<C>& joint, const D& d, Sixfold<T>& l) {
  if constexpr (moved) {
    l.v = l.v + link.p[0] * l.z;
    l.w = l.w - link.p[0] * l.y;
    if (link.p[1] != S(0)) {
      l.w = l.w + link.p[1] * l.x;
      l.u = l.u - link.p[1] * l.z;
    }
    if (link.p[2] != S(0)) {
      l.u = l.u + link.p[2] * l.y;
      l.v = l.v - link.p[2] * l.x;
    }
  }
  if (link.turned) {
    turn_back(model.uncommon(link).theta, l.x, l.y);
    turn_back(model.uncommon(link).theta, l.u, l.v);
  }
  tilt_back(link, l.y, l.z);
  tilt_back(link, l.v, l.w);
  turn_back(joint, l.x, l.y);
  turn_back(joint, l.u, l.v);
  if constexpr (moved) {
    l.u = l.u + d * l.y;
    l.v = l.v - d * l.x;
  }
}

template <class T, class U>
KALMARM_INLINE void force_to_parent(const MatrixPlacement<U>& phi, Sixfold<T>& z) {
  const auto& R = phi.R.R;
  const auto& p = phi.p;
  const Sixfold<T> in = z;
  z.x = R[0][0] * in.x + R[0][1] * in.y + R[0][2] * in.z;
  z.y = R[1][0] * in.x + R[1][1] * in.y + R[1][2] * in.z;
  z.z = R[2][0] * in.x + R[2][1] * in.y + R[2][2] * in.z;
  z.u = R[0][0] * in.u + R[0][1] * in.v + R[0][2] * in.w;
  z.v = R[1][0] * in.u + R[1][1] * in.v + R[1][2] * in.w;
  z.w = R[2][0] * in.u + R[2][1] * in.v + R[2][2] * in.w;
  z.x += p[1] * z.w - p[2] * z.v;
  z.y += p[2] * z.u - p[0] * z.w;
  z.z += p[0] * z.v - p[1] * z.u;
}

// The same, not inlined: rarely run code would take registers from the caller.
template <class T>
KALMARM_NOINLINE void far_force_to_parent(const MatrixPlacement<T>& phi, Sixfold<T>& z) {
  force_to_parent(phi, z);
}

// R'x.
template <class T, class U>
KALMARM_INLINE void turn_back(const Rotation<U>& by, T& x, T& y, T& z) {
  const auto& R = by.R;
  const T new_x = R[0][0] * x + R[1][0] * y + R[2][0] * z;
  const T new_y = R[0][1] * x + R[1][1] * y + R[2][1] * z;
  z = R[0][2] * x + R[1][2] * y + R[2][2] * z;
  x = new_x;
  y = new_y;
}

template <bool moved = true, class T, class U>
KALMARM_INLINE void motion_from_parent(const MatrixPlacement<U>& phi, Sixfold<T>& l) {
  if constexpr (moved) {
    const auto& p = phi.p;
    l.u -= p[1] * l.z - p[2] * l.y;
    l.v -= p[2] * l.x - p[0] * l.z;
    l.w -= p[0] * l.y - p[1] * l.x;
  }
  turn_back(phi.R, l.x, l.y, l.z);
  turn_back(phi.R, l.u, l.v, l.w);
}

// R = E R(q) C or E C, p = p or p + E q, as model.hpp says.
template <class T, class S>
KALMARM_NOINLINE void set_matrix(const LoweredLink<S>& link, const Matrix3<S>& E, const T* q,
                                 MatrixPlacement<T>& phi) {
  T X[3][3];
  for (int i = 0; i < 3; ++i) phi.p[i] = T(link.p[i]);
  if (link.coordinate == Coordinate::position) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        X[i][j] = T(E(i, j));
        phi.p[i] += X[i][j] * q[j];
      }
  } else {
    const T squares = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const T s = T(S(2)) / squares + T(S(0)) * squares;  // NaN where they overflow, not no turn
    const T x = s * q[1], y = s * q[2], z = s * q[3], one = T(S(1));
    const T Q[3][3] = {{one - (y * q[2] + z * q[3]), x * q[2] - z * q[0], x * q[3] + y * q[0]},
                       {x * q[2] + z * q[0], one - (x * q[1] + z * q[3]), y * q[3] - x * q[0]},
                       {x * q[3] - y * q[0], y * q[3] + x * q[0], one - (x * q[1] + y * q[2])}};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        X[i][j] = T(E(i, 0)) * Q[0][j] + T(E(i, 1)) * Q[1][j] + T(E(i, 2)) * Q[2][j];
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) phi.R.R[i][j] = X[i][(j + 1) % 3];
}

// W x = w (w'x) - x w'w.
template <class T, class S>
KALMARM_INLINE void centripetal(const LoweredLink<S>& link, const T& wx, const T& wy, const T& wz,
                                Sixfold<T>& c) {
  const T xx = wx * wx, yy = wy * wy, zz = wz * wz, xy = wx * wy, xz = wx * wz;
  c.u = -link.p[0] * (yy + zz);
  c.v = link.p[0] * xy;
  c.w = link.p[0] * xz;
  if (link.p[1] != S(0)) {
    c.u = c.u + link.p[1] * xy;
    c.v = c.v - link.p[1] * (xx + zz);
    c.w = c.w + link.p[1] * (wy * wz);
  }
  if (link.p[2] != S(0)) {
    c.u = c.u + link.p[2] * xz;
    c.v = c.v + link.p[2] * (wy * wz);
    c.w = c.w - link.p[2] * (xx + yy);
  }
}

// w and c of a link on a hinge or slide from w of the parent, without the joint's own motion.
template <class T, class S, class C, class D>
KALMARM_INLINE void cross_outward(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                  const Direction<C>& joint, const D& d, T& wx, T& wy, T& wz,
                                  Sixfold<T>& c) {
  centripetal(link, wx, wy, wz, c);
  if (link.turned) {
    turn_back(model.uncommon(link).theta, wx, wy);
    turn_back(model.uncommon(link).theta, c.u, c.v);
  }
  tilt_back(link, wy, wz);
  tilt_back(link, c.v, c.w);
  turn_back(joint, wx, wy);
  turn_back(joint, c.u, c.v);
  const T dz = d * wz;
  c.u += dz * wx;
  c.v += dz * wy;
  c.w = c.w - d * (wx * wx + wy * wy);
}

// The same across a matrix.
template <class T>
KALMARM_NOINLINE void cross_outward(const MatrixPlacement<T>& phi, T& wx, T& wy, T& wz,
                                    Sixfold<T>& c) {
  const T x = phi.p[0], y = phi.p[1], z = phi.p[2], xx = wx * wx, yy = wy * wy, zz = wz * wz;
  c.u = wx * (wy * y + wz * z) - (yy + zz) * x;  // no squares that cancel
  c.v = wy * (wx * x + wz * z) - (xx + zz) * y;
  c.w = wz * (wx * x + wy * y) - (xx + yy) * z;
  turn_back(phi.R, c.u, c.v, c.w);
  turn_back(phi.R, wx, wy, wz);
}

}  // namespace detail

}  // namespace kalmarm
