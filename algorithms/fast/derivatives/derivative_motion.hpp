// Motion of the links and what the filter needs of their bodies, for the derivatives of forward
// dynamics: rotation, r, v-, v+ joint by joint; psi, M(k), bias and 2B(k) of (B1) in
// derivative_terms.hpp for a block of joints at once.
#pragma once

#include "algorithms/fast/derivatives/derivative_terms.hpp"

namespace kalmarm {

namespace detail {

// Rotation, r, v- and v+ of every link.
template <class T, class S>
void set_motion(const LoweredModel<S>& model, const T* q, const T* qd, DerivativeTerms<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using Kind = typename LoweredLink<S>::Kind;
  const T zero = T(S(0)), one = T(S(1));
  Triple<T> X, Y, Z, w, v;
  Triple<T> w_before = {zero, zero, zero}, v_before = w_before;
  int body = 0;  // first DoF of the joint
  for (int k = 0; k < model.nv(); ++k) {
    const LoweredLink<S>& link = model.link(k);
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
        r = r + (q[link.q_index] + T(link.d)) * Z;
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

}  // namespace detail

}  // namespace kalmarm
