// What the derivatives of forward dynamics are made of, joint by joint.
//
// Axes are common to a tree: those of its root's placement. Reference points are not: everything
// about link k is about its own origin, which a hinge's axis runs through, so that H = (s; 0), or
// (0; s) of a slide, and what is passed on is moved by r = o(k) - o(parent) alone:
//   force (n; f) -> (n + r x f; f) inward                                                   phi
//   motion (w; v) -> (w; v + w x r) outward                                                 phi'
// Velocities v and accelerations a are spatial, gravity is the acceleration of the base. With v-,
// a- of the joint's inboard side (for the three DoF of a ball joint: of all three) and v+ of its
// body:
//   psi = v- x H,  chi = a- x H + v- x psi                           how H moves the outboard side
//   2B(k) = [2(tr Gamma 1 - Gamma'); -2p~],  6x3, acts on a turn alone,                        (B1)
//   Gamma = h v' - (tr I/2 1 - I) w~,  p = m v + w x h               from I, h, m about o(k)
// tips to base, with P, D, g, e of the filter (forward_dynamics.hpp), z- and Q- the forces at
// no acceleration, and per unit of a turn of everything outboard:
//   P+ = P- - g u',  u = P- H',  D = H u + r,  g = u / D                                    (3.6)
//   Q- = 2B + sum of phi Q+,  q = Q-'H' / D,  Q+ = Q- - g H Q-                                 (B2)
//   z+ = z- + g e + P+ c,  c = psi q'                                                       (4.5)
// base to tips: a+ = phi' a- + c,  q'' = e / D - g'a+,  a- = a+ + H' q''                   (4.9)
// then the force that a column of da/dq and of da/dq' starts from, with F = P- a- + z-:
//   dq:  x = Q- psi_w + P- chi + H x* F         dq': x = Q- H_w + P- (v- + v+) x H             (B3)
// H x* F acts on the far side of the joint; the axes of a ball joint turn with its body, so there
// it is kept apart, for the far side of all three.
// Forces from outside turn with their body, so that z- and F contain them: z- begins at minus their sum.
// A slide that no hinge precedes moves all alike, so its velocity is left out: nothing depends on
// how fast or where a robot travels.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/fast/covariance/forward_dynamics.hpp"
#include "algorithms/fast/derivatives/joint_table.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// Of one joint, for the sweeps over columns.
template <class T>
struct DerivativeJoint {
  Triple<T> r, s;
  Sixfold<T> g;
  Triple<T> q;
  T inverse_D, e;
};

template <class T>
struct DerivativeTerms {
  // Rows of the table. Six numbers are (angular; linear) or (moment; force).
  enum Number {
    x_axis = 0,
    y_axis = 3,
    z_axis = 6,     // columns of the link's rotation
    before = 9,     // v-
    after = 15,     // v+
    inertia = 21,   // xx xy yy xz yz zz
    h = 27,         // first moment
    bias = 30,      // v x* M v
    twice_B = 36,   // columns of its moments
    twice_p = 45,   //
    psi = 48,       //
    P = 54,         // P-, in the order of Articulated
    Q = 75,         // Q-, by columns
    z = 93,         // z-
    a_before = 99,  // a-
    a = 105,        // of the link
    x_q = 111,      // x of dq
    x_qd = 117,     // x of dq'
    H_x_F = 123,    //
    chi = 129,      //
    chi_qd = 135,   // (v- + v+) x H
    turn = 141,     // H_w
    numbers = 144,
  };
  enum Constant {
    mass = 0,
    body_h = 1,
    body_I = 4,   // as inertia
    turns = 10,   // 1 at a hinge
    single = 11,  // 0 at a ball joint's DoF
    constants = 12,
  };
  struct Branch {
    Articulated<T> P;
    Sixfold<T> z, Qx, Qy, Qz;
  };

  JointTable<T, numbers> table;
  JointTable<T, constants> constant;
  std::vector<DerivativeJoint<T>> joints;
  std::vector<bool> travels;   // no hinge inboard, nor is it one
  std::vector<T> q, sin, cos;  // of the hinges
  std::vector<MatrixPlacement<T>> matrices;
  std::vector<Branch> branches;
  const T* gravity = nullptr;  // as the last call's Acting has it
  T check;                     // zero where every acceleration was finite, else NaN

  template <class S>
  explicit DerivativeTerms(const LoweredModel<S>& model)
      : table(model.nv()),
        constant(model.nv()),
        joints(model.nv()),
        travels(model.nv()),
        q((model.angles() + padding<T> - 1) / padding<T> * padding<T>, T(0)),
        sin(q),
        cos(q),
        matrices(model.matrices()),
        branches(model.branch_count()) {
    bool ball = false;
    for (int k = 0; k < model.nv(); ++k) {
      const LoweredLink<S>& link = model.link(k);
      const LoweredBody<S>& body = model.body(k);
      set_body(k, body);
      ball = link.coordinate == Coordinate::quaternion ||
             (ball && link.coordinate == Coordinate::follower);
      constant.at(turns, k) = link.slides ? T(0) : T(1);
      constant.at(single, k) = ball ? T(0) : T(1);
      travels[k] = link.slides && (link.parent < 0 || travels[link.parent]);
    }
  }

  // The bodies of links that are loaded, and gravity, as a call has them.
  template <class S>
  void set_given(const LoweredModel<S>& model, const Acting<T>& acting) {
    gravity = acting.gravity;
    for (const LoweredFrame<S>& frame : model.loaded())
      set_body(frame.link, model.body(frame.link));
    detail::for_each_load(model, acting, [this](std::size_t, int k, const Load<T>& load) {
      LoweredBody<T> sum = load.body;
      sum.m += constant.at(mass, k);
      const Triple<T> own_h = constant.triple(body_h, k);
      sum.h[0] += own_h.x;
      sum.h[1] += own_h.y;
      sum.h[2] += own_h.z;
      sum.Ixx += constant.at(body_I, k);
      sum.Ixy += constant.at(body_I + 1, k);
      sum.Iyy += constant.at(body_I + 2, k);
      sum.Ixz += constant.at(body_I + 3, k);
      sum.Iyz += constant.at(body_I + 4, k);
      sum.Izz += constant.at(body_I + 5, k);
      set_body(k, sum);
    });
  }

 private:
  template <class S>
  void set_body(int k, const LoweredBody<S>& body) {
    const T I[] = {T(body.Ixx), T(body.Ixy), T(body.Iyy), T(body.Ixz), T(body.Iyz), T(body.Izz)};
    constant.at(mass, k) = T(body.m);
    constant.set(body_h, k, {T(body.h[0]), T(body.h[1]), T(body.h[2])});
    for (int i = 0; i < 6; ++i) constant.at(body_I + i, k) = I[i];
  }
};

namespace detail {

template <class T>
KALMARM_INLINE void add_scaled(Sixfold<T>& y, const T& a, const Sixfold<T>& x) {
  y.x += a * x.x;
  y.y += a * x.y;
  y.z += a * x.z;
  y.u += a * x.u;
  y.v += a * x.v;
  y.w += a * x.w;
}

// H x and x += H'a.
template <bool slides, class T, class X>
KALMARM_INLINE X along(const Triple<T>& s, const Sixfold<X>& x) {
  if constexpr (slides)
    return X(s.x) * x.u + X(s.y) * x.v + X(s.z) * x.w;
  else
    return X(s.x) * x.x + X(s.y) * x.y + X(s.z) * x.z;
}
template <bool slides, class T, class X>
KALMARM_INLINE void add_along(Sixfold<X>& x, const Triple<T>& s, const X& a) {
  (slides ? x.u : x.x) += X(s.x) * a;
  (slides ? x.v : x.y) += X(s.y) * a;
  (slides ? x.w : x.z) += X(s.z) * a;
}

// phi and phi'.
template <class T, class X>
KALMARM_INLINE void move_inward(const Triple<T>& r, Sixfold<X>& x) {
  x.x = x.x + X(r.y) * x.w - X(r.z) * x.v;
  x.y = x.y + X(r.z) * x.u - X(r.x) * x.w;
  x.z = x.z + X(r.x) * x.v - X(r.y) * x.u;
}
template <class T, class X>
KALMARM_INLINE void move_outward(const Triple<T>& r, Sixfold<X>& x) {
  x.u = x.u + X(r.z) * x.y - X(r.y) * x.z;
  x.v = x.v + X(r.x) * x.z - X(r.z) * x.x;
  x.w = x.w + X(r.y) * x.x - X(r.x) * x.y;
}

template <class T>
KALMARM_INLINE void set(JointTable<T, DerivativeTerms<T>::numbers>& table, int number, int k,
                        const Sixfold<T>& x) {
  table.set(number, k, {x.x, x.y, x.z});
  table.set(number + 3, k, {x.u, x.v, x.w});
}
template <class T>
KALMARM_INLINE Sixfold<T> six(const JointTable<T, DerivativeTerms<T>::numbers>& table, int number,
                              int k) {
  const Triple<T> a = table.triple(number, k), b = table.triple(number + 3, k);
  return {a.x, a.y, a.z, b.x, b.y, b.z};
}

// f(i, number i of P).
template <class A, class F>
KALMARM_INLINE void for_numbers(A& P, const F& f) {
  f(0, P.Axx), f(1, P.Axy), f(2, P.Ayy), f(3, P.Axz), f(4, P.Ayz), f(5, P.Azz);
  f(6, P.Bxx), f(7, P.Bxy), f(8, P.Byx), f(9, P.Byy), f(10, P.Bxz), f(11, P.Byz);
  f(12, P.Bzx), f(13, P.Bzy), f(14, P.Bzz);
  f(15, P.Cxx), f(16, P.Cxy), f(17, P.Cyy), f(18, P.Cxz), f(19, P.Cyz), f(20, P.Czz);
}

// P - g u'.
template <class T>
KALMARM_INLINE void subtract(const Sixfold<T>& g, const Sixfold<T>& u, Articulated<T>& P) {
  P.Axx -= g.x * u.x;
  P.Axy -= g.x * u.y;
  P.Ayy -= g.y * u.y;
  P.Axz -= g.x * u.z;
  P.Ayz -= g.y * u.z;
  P.Azz -= g.z * u.z;
  P.Bxx -= g.x * u.u;
  P.Bxy -= g.x * u.v;
  P.Byx -= g.y * u.u;
  P.Byy -= g.y * u.v;
  P.Bxz -= g.x * u.w;
  P.Byz -= g.y * u.w;
  P.Bzx -= g.z * u.u;
  P.Bzy -= g.z * u.v;
  P.Bzz -= g.z * u.w;
  P.Cxx -= g.u * u.u;
  P.Cxy -= g.u * u.v;
  P.Cyy -= g.v * u.v;
  P.Cxz -= g.u * u.w;
  P.Cyz -= g.v * u.w;
  P.Czz -= g.w * u.w;
}

}  // namespace detail

}  // namespace kalmarm
