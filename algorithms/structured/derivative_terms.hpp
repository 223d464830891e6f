// What the derivatives of forward dynamics are made of, joint by joint.
//
// Axes are common to a tree: those of its root's placement. Reference points are not: everything
// about link k is about its own origin, which a hinge's axis runs through, so that H = (s; 0), or
// (0; s) of a slide, and what is passed on is moved by r = o(k) - o(parent) alone:
//   force (n; f) -> (n + r x f; f) inward,   motion (w; v) -> (w; v + w x r) outward       phi,
//   phi'
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
// A slide that no hinge precedes moves all alike, so its velocity is left out: nothing depends on
// how fast or where a robot travels.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/structured/forward_dynamics.hpp"
#include "algorithms/structured/joint_table.hpp"

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
    bool begun;
    Articulated<T> P;
    Sixfold<T> z, Qx, Qy, Qz;
    Size<T> size;
  };

  JointTable<T, numbers> table;
  JointTable<T, constants> constant;
  std::vector<DerivativeJoint<T>> joints;
  std::vector<bool> travels;  // no hinge inboard, nor is it one
  std::vector<T> angle, sin, cos;
  std::vector<MatrixPlacement<T>> matrices;
  std::vector<Branch> branches;
  T margin;  // least D - net x size of the last call
  T check;   // zero where every acceleration was finite, else NaN

  template <class S>
  explicit DerivativeTerms(const StructuredModel<S>& model)
      : table(model.nv()),
        constant(model.nv()),
        joints(model.nv()),
        travels(model.nv()),
        angle((model.angles() + padding<T> - 1) / padding<T> * padding<T>, T(0)),
        sin(angle),
        cos(angle),
        matrices(model.matrices()),
        branches(model.slots()) {
    bool ball = false;
    for (int k = 0; k < model.nv(); ++k) {
      const StructuredLink<S>& link = model.link(k);
      const StructuredBody<S>& body = model.body(k);
      const S I[] = {body.Ixx, body.Ixy, body.Iyy, body.Ixz, body.Iyz, body.Izz};
      constant.at(mass, k) = T(body.m);
      constant.set(body_h, k, {T(body.h[0]), T(body.h[1]), T(body.h[2])});
      for (int i = 0; i < 6; ++i) constant.at(body_I + i, k) = T(I[i]);
      ball = link.coordinate == Coordinate::quaternion ||
             (ball && link.coordinate == Coordinate::follower);
      constant.at(turns, k) = link.slides ? T(0) : T(1);
      constant.at(single, k) = ball ? T(0) : T(1);
      travels[k] = link.slides && (link.parent < 0 || travels[link.parent]);
    }
  }
};

namespace detail {

template <class T>
[[gnu::always_inline]] inline void add_scaled(Sixfold<T>& y, const T& a, const Sixfold<T>& x) {
  y.x += a * x.x;
  y.y += a * x.y;
  y.z += a * x.z;
  y.u += a * x.u;
  y.v += a * x.v;
  y.w += a * x.w;
}

// H x and x += H'a.
template <bool slides, class T, class X>
[[gnu::always_inline]] inline X along(const Triple<T>& s, const Sixfold<X>& x) {
  if constexpr (slides)
    return X(s.x) * x.u + X(s.y) * x.v + X(s.z) * x.w;
  else
    return X(s.x) * x.x + X(s.y) * x.y + X(s.z) * x.z;
}
template <bool slides, class T, class X>
[[gnu::always_inline]] inline void add_along(const Triple<T>& s, const X& a, Sixfold<X>& x) {
  (slides ? x.u : x.x) += X(s.x) * a;
  (slides ? x.v : x.y) += X(s.y) * a;
  (slides ? x.w : x.z) += X(s.z) * a;
}

// phi and phi'.
template <class T, class X>
[[gnu::always_inline]] inline void move_inward(const Triple<T>& r, Sixfold<X>& x) {
  x.x = x.x + X(r.y) * x.w - X(r.z) * x.v;
  x.y = x.y + X(r.z) * x.u - X(r.x) * x.w;
  x.z = x.z + X(r.x) * x.v - X(r.y) * x.u;
}
template <class T, class X>
[[gnu::always_inline]] inline void move_outward(const Triple<T>& r, Sixfold<X>& x) {
  x.u = x.u + X(r.z) * x.y - X(r.y) * x.z;
  x.v = x.v + X(r.x) * x.z - X(r.z) * x.x;
  x.w = x.w + X(r.y) * x.x - X(r.x) * x.y;
}

template <class T>
[[gnu::always_inline]] inline void set(JointTable<T, DerivativeTerms<T>::numbers>& table,
                                       int number, int k, const Sixfold<T>& x) {
  table.set(number, k, {x.x, x.y, x.z});
  table.set(number + 3, k, {x.u, x.v, x.w});
}
template <class T>
[[gnu::always_inline]] inline Sixfold<T> six(
    const JointTable<T, DerivativeTerms<T>::numbers>& table, int number, int k) {
  const Triple<T> a = table.triple(number, k), b = table.triple(number + 3, k);
  return {a.x, a.y, a.z, b.x, b.y, b.z};
}

// f(i, number i of P).
template <class A, class F>
[[gnu::always_inline]] inline void for_numbers(A& P, const F& f) {
  f(0, P.Axx), f(1, P.Axy), f(2, P.Ayy), f(3, P.Axz), f(4, P.Ayz), f(5, P.Azz);
  f(6, P.Bxx), f(7, P.Bxy), f(8, P.Byx), f(9, P.Byy), f(10, P.Bxz), f(11, P.Byz);
  f(12, P.Bzx), f(13, P.Bzy), f(14, P.Bzz);
  f(15, P.Cxx), f(16, P.Cxy), f(17, P.Cyy), f(18, P.Cxz), f(19, P.Cyz), f(20, P.Czz);
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

// P - g u'.
template <class T>
[[gnu::always_inline]] inline void subtract(const Sixfold<T>& g, const Sixfold<T>& u,
                                            Articulated<T>& P) {
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

// Rotation, r, v- and v+ of every link.
template <class T, class S>
void set_motion(const StructuredModel<S>& model, const T* q, const T* qd, DerivativeTerms<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using Kind = typename StructuredLink<S>::Kind;
  const T zero = T(S(0)), one = T(S(1));
  Triple<T> X, Y, Z, w, v;
  Triple<T> w_before = {zero, zero, zero}, v_before = w_before;
  int body = 0;  // first DoF of the joint
  for (int k = 0; k < model.nv(); ++k) {
    const StructuredLink<S>& link = model.link(k);
    if (link.parent < 0) {
      X = {one, zero, zero};
      Y = {zero, one, zero};
      Z = {zero, zero, one};
      w = v = {zero, zero, zero};
    } else if (!link.hangs_on_previous) {
      X = ws.table.triple(Terms::x_axis, link.parent);
      Y = ws.table.triple(Terms::y_axis, link.parent);
      Z = ws.table.triple(Terms::z_axis, link.parent);
      w = ws.table.triple(Terms::after, link.parent);
      v = ws.table.triple(Terms::after + 3, link.parent);
    }
    Triple<T> r = {zero, zero, zero};
    const auto turn_axes = [](const auto& by, Triple<T>& a, Triple<T>& b) {
      const Triple<T> old = a;
      a = T(by.c) * a + T(by.s) * b;
      b = T(by.c) * b - T(by.s) * old;
    };
    if (link.kind == Kind::screws) {
      r = T(link.p[0]) * X;
      if (link.p[1] != S(0)) r = r + T(link.p[1]) * Y;
      if (link.p[2] != S(0)) r = r + T(link.p[2]) * Z;
      if (link.turned) turn_axes(model.uncommon(link).theta, X, Y);
      turn_axes(link.alpha, Y, Z);
      if (link.slides) {
        turn_axes(model.uncommon(link).turn, X, Y);
        r = r + (q[link.q_index] + T(link.offset)) * Z;
      } else {
        turn_axes(Direction<T>{ws.cos[link.varying], ws.sin[link.varying]}, X, Y);
        r = r + T(link.d) * Z;
      }
    } else if (link.kind == Kind::matrix) {
      auto& phi = ws.matrices[link.varying];
      set_matrix(link, model.uncommon(link).E, q + link.q_index, phi);
      const auto& R = phi.R.R;
      r = phi.p[0] * X + phi.p[1] * Y + phi.p[2] * Z;
      const Triple<T> x = X, y = Y, z = Z;
      X = R[0][0] * x + R[1][0] * y + R[2][0] * z;
      Y = R[0][1] * x + R[1][1] * y + R[2][1] * z;
      Z = R[0][2] * x + R[1][2] * y + R[2][2] * z;
    } else {
      const Triple<T> x = X;
      X = Y;
      Y = Z;
      Z = x;
    }
    if (link.kind != Kind::cyclic) {
      v = v + cross(w, r);
      w_before = w;
      v_before = v;
      body = k;
    }
    if (!link.slides)
      w = w + qd[k] * Z;
    else if (!ws.travels[k])
      v = v + qd[k] * Z;
    ws.joints[k].r = r;
    ws.joints[k].s = Z;
    ws.table.set(Terms::x_axis, k, X);
    ws.table.set(Terms::y_axis, k, Y);
    ws.table.set(Terms::z_axis, k, Z);
    ws.table.set(Terms::before, k, w_before);
    ws.table.set(Terms::before + 3, k, v_before);
    for (int i = body; i <= k; ++i) {
      ws.table.set(Terms::after, i, w);
      ws.table.set(Terms::after + 3, i, v);
    }
  }
}

// What the filter needs of a block of bodies.
template <class T>
void set_bodies(int block, DerivativeTerms<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using W = Wide<T>;
  auto& table = ws.table;
  const auto constant = [&](int number) { return ws.constant.load(number, block); };
  const Triple<W> X = table.load3(Terms::x_axis, block), Y = table.load3(Terms::y_axis, block),
                  Z = table.load3(Terms::z_axis, block);
  const Triple<W> h = constant(Terms::body_h) * X + constant(Terms::body_h + 1) * Y +
                      constant(Terms::body_h + 2) * Z;
  const W Ixx = constant(Terms::body_I), Ixy = constant(Terms::body_I + 1),
          Iyy = constant(Terms::body_I + 2), Ixz = constant(Terms::body_I + 3),
          Iyz = constant(Terms::body_I + 4), Izz = constant(Terms::body_I + 5);
  const Triple<W> IX = Ixx * X + Ixy * Y + Ixz * Z, IY = Ixy * X + Iyy * Y + Iyz * Z,
                  IZ = Ixz * X + Iyz * Y + Izz * Z;
  const W xx = IX.x * X.x + IY.x * Y.x + IZ.x * Z.x, xy = IX.x * X.y + IY.x * Y.y + IZ.x * Z.y,
          yy = IX.y * X.y + IY.y * Y.y + IZ.y * Z.y, xz = IX.x * X.z + IY.x * Y.z + IZ.x * Z.z,
          yz = IX.y * X.z + IY.y * Y.z + IZ.y * Z.z, zz = IX.z * X.z + IY.z * Y.z + IZ.z * Z.z;
  table.store3(Terms::inertia, block, {xx, xy, yy});
  table.store3(Terms::inertia + 3, block, {xz, yz, zz});
  table.store3(Terms::h, block, h);

  const Triple<W> w = table.load3(Terms::after, block), v = table.load3(Terms::after + 3, block);
  const Triple<W> p = constant(Terms::mass) * v + cross(w, h);
  const Triple<W> Ix = {xx, xy, xz}, Iy = {xy, yy, yz}, Iz = {xz, yz, zz};
  const Triple<W> L = Triple<W>{dot(Ix, w), dot(Iy, w), dot(Iz, w)} + cross(h, v);
  table.store3(Terms::bias, block, cross(w, L) + cross(v, p));
  table.store3(Terms::bias + 3, block, cross(w, p));
  table.store3(Terms::twice_p, block, p + p);

  // (B1): 2 w~ (I - tr I / 2) + 2 (h'v 1 - v h'), columns
  const W two = W(T(2)), hv = dot(h, v), half_trace = (xx + yy + zz) * W(T(0.5));
  const auto column = [&](const Triple<W>& I, const W& h_i) { return cross(w, I) - h_i * v; };
  Triple<W> x = column({xx - half_trace, xy, xz}, h.x);
  Triple<W> y = column({xy, yy - half_trace, yz}, h.y);
  Triple<W> z = column({xz, yz, zz - half_trace}, h.z);
  x.x += hv;
  y.y += hv;
  z.z += hv;
  table.store3(Terms::twice_B, block, two * x);
  table.store3(Terms::twice_B + 3, block, two * y);
  table.store3(Terms::twice_B + 6, block, two * z);

  const W turns = constant(Terms::turns);
  const Triple<W> H_w = turns * Z, H_v = Z - H_w;
  const Triple<W> w_before = table.load3(Terms::before, block),
                  v_before = table.load3(Terms::before + 3, block);
  table.store3(Terms::turn, block, H_w);
  table.store3(Terms::psi, block, cross(w_before, H_w));
  table.store3(Terms::psi + 3, block, cross(w_before, H_v) + cross(v_before, H_w));
}

// Across the joint of link k: what is kept of it, and P-, Q-, z- become P+, Q+, z+.
template <bool slides, class T, class S>
[[gnu::always_inline]] inline void cross_joint(int k, const S& noise, const T& tau, const T& qd,
                                               DerivativeTerms<T>& ws, Articulated<T>& P,
                                               Sixfold<T>& z, Sixfold<T>& Qx, Sixfold<T>& Qy,
                                               Sixfold<T>& Qz, const Size<T>& size) {
  using Terms = DerivativeTerms<T>;
  using std::min;
  DerivativeJoint<T>& at = ws.joints[k];
  const Triple<T> s = at.s;
  Sixfold<T> u;
  if constexpr (slides)
    u = {P.Bxx * s.x + P.Bxy * s.y + P.Bxz * s.z, P.Byx * s.x + P.Byy * s.y + P.Byz * s.z,
         P.Bzx * s.x + P.Bzy * s.y + P.Bzz * s.z, P.Cxx * s.x + P.Cxy * s.y + P.Cxz * s.z,
         P.Cxy * s.x + P.Cyy * s.y + P.Cyz * s.z, P.Cxz * s.x + P.Cyz * s.y + P.Czz * s.z};
  else
    u = {P.Axx * s.x + P.Axy * s.y + P.Axz * s.z, P.Axy * s.x + P.Ayy * s.y + P.Ayz * s.z,
         P.Axz * s.x + P.Ayz * s.y + P.Azz * s.z, P.Bxx * s.x + P.Byx * s.y + P.Bzx * s.z,
         P.Bxy * s.x + P.Byy * s.y + P.Bzy * s.z, P.Bxz * s.x + P.Byz * s.y + P.Bzz * s.z};
  const T D = along<slides>(s, u) + T(noise);
  const T inverse_D = T(S(1)) / D;
  const T net = T(SingularityTest<S, 1>::net());
  ws.margin = min(ws.margin, T(D - net * (slides ? size.force : size.moment)));
  const Sixfold<T> g = {u.x * inverse_D, u.y * inverse_D, u.z * inverse_D,
                        u.u * inverse_D, u.v * inverse_D, u.w * inverse_D};
  subtract(g, u, P);
  const T Hx = along<slides>(s, Qx), Hy = along<slides>(s, Qy), Hz = along<slides>(s, Qz);
  add_scaled(Qx, T(-Hx), g);
  add_scaled(Qy, T(-Hy), g);
  add_scaled(Qz, T(-Hz), g);
  const T e = tau - along<slides>(s, z);
  add_scaled(z, e, g);
  const Sixfold<T> psi = six(ws.table, Terms::psi, k);
  const Sixfold<T> Pc = times(P, {qd * psi.x, qd * psi.y, qd * psi.z,  //
                                  qd * psi.u, qd * psi.v, qd * psi.w});
  add(z, Pc);
  at.g = g;
  at.q = {Hx * inverse_D, Hy * inverse_D, Hz * inverse_D};
  at.inverse_D = inverse_D;
  at.e = e * inverse_D;
}

// P-, Q-, z- and what the sweeps need of every joint.
template <class T, class S>
void filter(const StructuredModel<S>& model, const T* tau, const T* qd, DerivativeTerms<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using Kind = typename StructuredLink<S>::Kind;
  const T zero = T(S(0)), two = T(S(2));
  auto& table = ws.table;
  ws.margin = T(S(1));
  for (auto& branch : ws.branches) branch.begun = false;
  Articulated<T> P;
  Sixfold<T> z, Qx, Qy, Qz;
  Size<T> size;
  bool carried = false;  // from link k + 1
  for (int k = model.nv() - 1; k >= 0; --k) {
    const StructuredLink<S>& link = model.link(k);
    const StructuredBody<S>& body = model.body(k);
    if (!carried) {
      for_numbers(P, [&](int, T& x) { x = zero; });
      z = Qx = Qy = Qz = {zero, zero, zero, zero, zero, zero};
      size = {zero, zero};
    }
    if (!link.massless) {
      const T m = T(body.m);
      const Triple<T> h = table.triple(Terms::h, k), p = table.triple(Terms::twice_p, k);
      const Triple<T> Bx = table.triple(Terms::twice_B, k),
                      By = table.triple(Terms::twice_B + 3, k),
                      Bz = table.triple(Terms::twice_B + 6, k);
      P.Axx += table.at(Terms::inertia, k);
      P.Axy += table.at(Terms::inertia + 1, k);
      P.Ayy += table.at(Terms::inertia + 2, k);
      P.Axz += table.at(Terms::inertia + 3, k);
      P.Ayz += table.at(Terms::inertia + 4, k);
      P.Azz += table.at(Terms::inertia + 5, k);
      P.Bxy -= h.z;
      P.Byx += h.z;
      P.Bxz += h.y;
      P.Byz -= h.x;
      P.Bzx -= h.y;
      P.Bzy += h.x;
      P.Cxx += m;
      P.Cyy += m;
      P.Czz += m;
      add(z, six(table, Terms::bias, k));
      add(Qx, {Bx.x, Bx.y, Bx.z, zero, -p.z, p.y});
      add(Qy, {By.x, By.y, By.z, p.z, zero, -p.x});
      add(Qz, {Bz.x, Bz.y, Bz.z, -p.y, p.x, zero});
    }
    size.moment += T(body.Ixx + body.Iyy + body.Izz + body.r);
    size.force += T(S(3) * body.m + body.r);
    if (link.slot >= 0) {
      const auto& branch = ws.branches[link.slot];
      add(P, branch.P);
      add(z, branch.z);
      add(Qx, branch.Qx);
      add(Qy, branch.Qy);
      add(Qz, branch.Qz);
      size.moment += branch.size.moment;
      size.force += branch.size.force;
    }
    for_numbers(P, [&](int i, const T& x) { table.at(Terms::P + i, k) = x; });
    set(table, Terms::z, k, z);
    set(table, Terms::Q, k, Qx);
    set(table, Terms::Q + 6, k, Qy);
    set(table, Terms::Q + 12, k, Qz);
    // What P- is, and rounding errors of what it was: in common axes HP+ = 0 but for them.
    const T past = T(S(0.25));
    const Size<T> left = {past * size.moment + (P.Axx + P.Ayy + P.Azz),
                          past * size.force + (P.Cxx + P.Cyy + P.Czz)};
    if (link.slides)
      cross_joint<true>(k, body.r, tau[k], qd[k], ws, P, z, Qx, Qy, Qz, size);
    else
      cross_joint<false>(k, body.r, tau[k], qd[k], ws, P, z, Qx, Qy, Qz, size);
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    size = left;
    if (link.kind != Kind::cyclic) {
      const Triple<T> r = ws.joints[k].r;
      size.moment = two * (size.moment + dot(r, r) * size.force);
      translate_x(r.x, P);
      translate_y(r.y, P);
      translate_z(r.z, P);
      move_inward(r, z);
      move_inward(r, Qx);
      move_inward(r, Qy);
      move_inward(r, Qz);
    }
    if (carried) continue;
    auto& branch = ws.branches[model.link(link.parent).slot];
    if (!branch.begun) {
      branch = {true, P, z, Qx, Qy, Qz, size};
      continue;
    }
    add(branch.P, P);
    add(branch.z, z);
    add(branch.Qx, Qx);
    add(branch.Qy, Qy);
    add(branch.Qz, Qz);
    branch.size.moment += size.moment;
    branch.size.force += size.force;
  }
}

// The accelerations: `qdd` of the joints, a- and a of every link.
template <class T, class S>
void accelerate(const StructuredModel<S>& model, const T* qd, DerivativeTerms<T>& ws, T* qdd) {
  using Terms = DerivativeTerms<T>;
  const T zero = T(S(0));
  Sixfold<T> a, before = {zero, zero, zero, zero, zero, zero};
  ws.check = zero;
  for (int k = 0; k < model.nv(); ++k) {
    const StructuredLink<S>& link = model.link(k);
    const DerivativeJoint<T>& at = ws.joints[k];
    if (link.parent < 0) {
      const Vector3<S>& a0 = model.uncommon(link).a0;
      a = {zero, zero, zero, T(a0[0]), T(a0[1]), T(a0[2])};
    } else {
      if (!link.hangs_on_previous) a = six(ws.table, Terms::a, link.parent);
      move_outward(at.r, a);
    }
    if (link.kind != StructuredLink<S>::Kind::cyclic) before = a;
    set(ws.table, Terms::a_before, k, before);
    add_scaled(a, qd[k], six(ws.table, Terms::psi, k));
    const auto& g = at.g;
    qdd[k] = ((at.e - g.x * a.x - g.y * a.y) - g.z * a.z) - ((g.u * a.u + g.v * a.v) + g.w * a.w);
    if (link.slides)
      add_along<true>(at.s, qdd[k], a);
    else
      add_along<false>(at.s, qdd[k], a);
    set(ws.table, Terms::a, k, a);
    ws.check += qdd[k] * zero;
  }
}

// (B3) and chi for a block of joints.
template <class T>
void set_starts(int block, DerivativeTerms<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using W = Wide<T>;
  auto& table = ws.table;
  const auto load6 = [&](int number) {
    const Triple<W> a = table.load3(number, block), b = table.load3(number + 3, block);
    return Sixfold<W>{a.x, a.y, a.z, b.x, b.y, b.z};
  };
  const auto store6 = [&](int number, const Sixfold<W>& x) {
    table.store3(number, block, {x.x, x.y, x.z});
    table.store3(number + 3, block, {x.u, x.v, x.w});
  };
  const Triple<W> H_w = table.load3(Terms::turn, block);
  const Triple<W> H_v = table.load3(Terms::z_axis, block) - H_w;
  const Triple<W> psi_w = table.load3(Terms::psi, block),
                  psi_v = table.load3(Terms::psi + 3, block);
  const Triple<W> w = table.load3(Terms::before, block), v = table.load3(Terms::before + 3, block);
  const Triple<W> a_w = table.load3(Terms::a_before, block),
                  a_v = table.load3(Terms::a_before + 3, block);
  const Triple<W> chi_w = cross(a_w, H_w) + cross(w, psi_w);
  const Triple<W> chi_v = cross(a_w, H_v) + cross(a_v, H_w) + cross(w, psi_v) + cross(v, psi_w);
  const Triple<W> w_sum = w + table.load3(Terms::after, block),
                  v_sum = v + table.load3(Terms::after + 3, block);
  const Triple<W> chi_qd_w = cross(w_sum, H_w), chi_qd_v = cross(w_sum, H_v) + cross(v_sum, H_w);
  const Sixfold<W> chi = {chi_w.x, chi_w.y, chi_w.z, chi_v.x, chi_v.y, chi_v.z};
  const Sixfold<W> chi_qd = {chi_qd_w.x, chi_qd_w.y, chi_qd_w.z,
                             chi_qd_v.x, chi_qd_v.y, chi_qd_v.z};
  store6(Terms::chi, chi);
  store6(Terms::chi_qd, chi_qd);

  Articulated<W> P;
  for_numbers(P, [&](int i, W& x) { x = table.load(Terms::P + i, block); });
  Sixfold<W> F = times(P, load6(Terms::a));
  add(F, load6(Terms::z));
  const Triple<W> n = {F.x, F.y, F.z}, f = {F.u, F.v, F.w};
  const Triple<W> moment = cross(H_w, n) + cross(H_v, f), force = cross(H_w, f);
  const Sixfold<W> H_x_F = {moment.x, moment.y, moment.z, force.x, force.y, force.z};
  store6(Terms::H_x_F, H_x_F);

  Sixfold<W> x_q = times(P, chi), x_qd = times(P, chi_qd);
  add_scaled(x_q, ws.constant.load(Terms::single, block), H_x_F);
  const auto add_Q = [&](int number, const W& turn_q, const W& turn_qd) {
    const Sixfold<W> column = load6(number);
    add_scaled(x_q, turn_q, column);
    add_scaled(x_qd, turn_qd, column);
  };
  add_Q(Terms::Q, psi_w.x, H_w.x);
  add_Q(Terms::Q + 6, psi_w.y, H_w.y);
  add_Q(Terms::Q + 12, psi_w.z, H_w.z);
  store6(Terms::x_q, x_q);
  store6(Terms::x_qd, x_qd);
}

}  // namespace detail

// All of the above, and qdd (nv).
template <class T, class S>
void derivative_terms(const StructuredModel<S>& model, const T* q, const T* qd, const T* tau,
                      DerivativeTerms<T>& ws, T* qdd) {
  detail::set_angles(model, q, ws);
  detail::set_motion(model, q, qd, ws);
  for (int block = 0; block < ws.table.blocks(); ++block) detail::set_bodies(block, ws);
  detail::filter(model, tau, qd, ws);
  detail::accelerate(model, qd, ws, qdd);
  for (int block = 0; block < ws.table.blocks(); ++block) detail::set_starts(block, ws);
}

}  // namespace kalmarm
