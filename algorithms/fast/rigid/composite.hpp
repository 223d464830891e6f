// Composite inertias of the fast path: the links outboard of a joint as one rigid body, ten numbers
// about the link's origin, P = [I h~; -h~ m 1] in the notation of articulated.hpp.
//
//   R(k) = M(k) + loads + sum over children c of phi(k,c) R(c) phi'(k,c)   (3.5)
//   F(k) = R(k) H'(k)                   force at link k that its acceleration costs
//   T(p): h <- h + m p,  I <- I - p~h~ - h~'p~ with the old h and the new one, one axis at a time
// About 75 flops an aligned hinge (lowered_model.hpp), and its sine and cosine.
#pragma once

#include <vector>

#include "algorithms/fast/kinematics/loads.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class T>
struct Rigid {
  T m, hx, hy, hz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz;
};

template <class T>
struct CompositeForces : Placements<T> {
  struct Link {
    T d;  // of a slide
    Sixfold<T> F;
  };
  // What the children of a link with several have summed up to.
  struct Branch {
    Rigid<T> R;
  };

  std::vector<Link> links;
  std::vector<Branch> branches;

  template <class S>
  explicit CompositeForces(const LoweredModel<S>& model)
      : Placements<T>(model), links(model.nv()), branches(model.branch_count()) {}
};

namespace detail {

template <class T>
KALMARM_INLINE void add(Rigid<T>& to, const Rigid<T>& from) {
  to.m += from.m;
  to.hx += from.hx;
  to.hy += from.hy;
  to.hz += from.hz;
  to.Ixx += from.Ixx;
  to.Ixy += from.Ixy;
  to.Ixz += from.Ixz;
  to.Iyy += from.Iyy;
  to.Iyz += from.Iyz;
  to.Izz += from.Izz;
}

// Of two axes, a tensor's numbers and those that go with a vector.
template <class T, class C>
KALMARM_INLINE void turn_inertia(const Turn<C>& by, T& xx, T& xy, T& yy, T& xz, T& yz, T& hx,
                                 T& hy) {
  const T h = xx - yy, u = xy + xy;
  const T delta = by.ss * h + by.cs * u;
  xy += by.cs * h - by.ss * u;
  xx -= delta;
  yy += delta;
  turn(by, xz, yz, xz, yz);
  turn(by, hx, hy, hx, hy);
}

// T(a,0,0), and T(0,a,0), T(0,0,a) with the axes in cyclic order.
template <class T, class D>
KALMARM_INLINE void shift_inertia(const D& a, const T& m, T& hx, const T& hy, const T& hz, T& Iyy,
                                  T& Izz, T& Ixy, T& Ixz) {
  const T before = hx;
  hx = hx + a * m;
  const T both = a * (before + hx);
  Iyy += both;
  Izz += both;
  Ixy = Ixy - a * hy;
  Ixz = Ixz - a * hz;
}

template <class T, class D>
KALMARM_INLINE void shift_x(const D& a, Rigid<T>& R) {
  shift_inertia(a, R.m, R.hx, R.hy, R.hz, R.Iyy, R.Izz, R.Ixy, R.Ixz);
}
template <class T, class D>
KALMARM_INLINE void shift_y(const D& b, Rigid<T>& R) {
  shift_inertia(b, R.m, R.hy, R.hz, R.hx, R.Izz, R.Ixx, R.Iyz, R.Ixy);
}
template <class T, class D>
KALMARM_INLINE void shift_z(const D& d, Rigid<T>& R) {
  shift_inertia(d, R.m, R.hz, R.hx, R.hy, R.Ixx, R.Iyy, R.Ixz, R.Iyz);
}

// Rx(alpha) R Rx(alpha)'. A right angle costs nothing.
template <class T, class S>
KALMARM_INLINE void tilt(const LoweredLink<S>& link, Rigid<T>& R) {
  using Tilt = typename LoweredLink<S>::Tilt;
  if (link.tilt == Tilt::right) {
    const T hy = R.hy, Iyy = R.Iyy, Ixy = R.Ixy;
    R.hy = -R.hz;
    R.hz = hy;
    R.Iyy = R.Izz;
    R.Izz = Iyy;
    R.Iyz = -R.Iyz;
    R.Ixy = -R.Ixz;
    R.Ixz = Ixy;
  } else if (link.tilt == Tilt::any) {
    turn_inertia(link.alpha, R.Iyy, R.Iyz, R.Izz, R.Ixy, R.Ixz, R.hy, R.hz);
  }
}

// phi R phi'.
template <class T, class S, class C, class D>
KALMARM_INLINE void to_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                              const Turn<C>& joint, const D& d, Rigid<T>& R) {
  shift_z(d, R);
  turn_inertia(joint, R.Ixx, R.Ixy, R.Iyy, R.Ixz, R.Iyz, R.hx, R.hy);
  tilt(link, R);
  if (link.turned)
    turn_inertia(model.uncommon(link).theta, R.Ixx, R.Ixy, R.Iyy, R.Ixz, R.Iyz, R.hx, R.hy);
  if (link.p[0] != S(0)) shift_x(link.p[0], R);
  if (link.p[1] != S(0)) shift_y(link.p[1], R);
  if (link.p[2] != S(0)) shift_z(link.p[2], R);
}

template <class T>
KALMARM_NOINLINE void to_parent(const MatrixPlacement<T>& phi, Rigid<T>& R) {
  T I[3][3];
  conjugate(phi.R, {{R.Ixx, R.Ixy, R.Ixz}, {R.Ixy, R.Iyy, R.Iyz}, {R.Ixz, R.Iyz, R.Izz}}, I);
  const auto& Q = phi.R.R;
  const T hx = Q[0][0] * R.hx + Q[0][1] * R.hy + Q[0][2] * R.hz;
  const T hy = Q[1][0] * R.hx + Q[1][1] * R.hy + Q[1][2] * R.hz;
  const T hz = Q[2][0] * R.hx + Q[2][1] * R.hy + Q[2][2] * R.hz;
  R = {R.m, hx, hy, hz, I[0][0], I[0][1], I[0][2], I[1][1], I[1][2], I[2][2]};
  shift_x(phi.p[0], R);
  shift_y(phi.p[1], R);
  shift_z(phi.p[2], R);
}

template <class T, class S>
KALMARM_INLINE Rigid<T> rigid(const LoweredBody<S>& body) {
  return {T(body.m),   T(body.h[0]), T(body.h[1]), T(body.h[2]), T(body.Ixx),
          T(body.Ixy), T(body.Ixz),  T(body.Iyy),  T(body.Iyz),  T(body.Izz)};
}

// F of every link.
template <class T, class S>
KALMARM_SWEEP void set_composite_forces(const LoweredModel<S>& model, const Acting<T>& loads,
                                        CompositeForces<T>& ws) {
  using Kind = typename LoweredLink<S>::Kind;
  const T zero = T(S(0));
  for (auto& branch : ws.branches)
    branch.R = {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
  for_each_load(model, loads, [&](std::size_t, int link, const Load<T>& load) {
    add(ws.branches[model.link(link).branch].R, rigid<T>(load.body));
  });
  Rigid<T> R;
  bool carried = false;  // R comes from link k + 1
  for (int k = model.nv() - 1; k >= 0; --k) {
    const LoweredLink<S>& link = model.link(k);
    auto& at = ws.links[k];
    const Rigid<T> own = rigid<T>(model.body(k));
    if (!carried)
      R = own;
    else if (!link.massless)
      add(R, own);
    if (link.branch >= 0) add(R, ws.branches[link.branch].R);
    if (link.slides)
      at.F = {R.hy, -R.hx, zero, zero, zero, R.m};
    else
      at.F = {R.Ixz, R.Iyz, R.Izz, -R.hy, R.hx, zero};
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    if (link.kind == Kind::screws) {
      if (link.slides)
        to_parent(model, link, model.uncommon(link).turn, at.d, R);
      else
        to_parent(model, link, Turn<T>(ws.cos[link.varying], ws.sin[link.varying]), link.d, R);
    } else if (link.kind == Kind::cyclic) {
      R = {R.m, R.hz, R.hx, R.hy, R.Izz, R.Ixz, R.Iyz, R.Ixx, R.Ixy, R.Iyy};
    } else {
      Rigid<T> moved = R;  // R stays in registers
      to_parent(ws.matrices[link.varying], moved);
      R = moved;
    }
    if (!carried) add(ws.branches[model.link(link.parent).branch].R, R);
  }
}

}  // namespace detail

// F at q (nq).
template <class T, class S>
void composite_forces(const LoweredModel<S>& model, const T* q, CompositeForces<T>& ws,
                      const Acting<T>& loads = {}) {
  detail::set_placements(model, q, ws);
  detail::set_composite_forces(model, loads, ws);
}

}  // namespace kalmarm
