// Forward dynamics by the structured form of the conventional filter and smoother (sweeps.hpp), for
// one state or, with T a Pack, one state in every lane.
//
// Accelerations are those of the material point at the link's origin, v' + w x v of the spatial
// form: the linear velocity then drops out. With W = w~w~ of the link, base to tips:
//   w(k) = R'w(parent) + H' q'                            its angular velocity
//   c(k) = (R'w x H' q';  R'W(parent) p + d W e_z)        at a hinge; W as it is before and after
//   c(k) = (0;            R'W(parent) p + d W e_z + 2 w x e_z q')         at a slide
//   b(k) = (w x I w;  W h)                                h = m c: bias of the link alone
// tips to base, with P of articulated.hpp:
//   e = tau - H z-,  e+ = e / D                                            (4.2), (4.6)
//   z+ = z- + g e + P+ c,  H z+ = tau where r = 0                          (4.5)
//   z-(parent) += phi z+                                                   (4.4)
// base to tips:
//   l+ = phi' l-(parent) + c,  a = e+ - g' l+,  l- = l+ + H' a             (4.10), (4.9), (4.11)
// Where r = 0, H l- = e+ - sum over j != h of g_j l+_j. About 430 flops a hinge that is an heir,
// and its sine and cosine.
#pragma once

#include <vector>

#include "algorithms/inverse_mass/singularity.hpp"
#include "algorithms/spatial/sincos.hpp"
#include "algorithms/structured/articulated.hpp"

namespace kalmarm {

// Sizes of the terms that A and C are summed from.
template <class T>
struct Size {
  T moment, force;
};

template <class T>
struct StructuredWorkspace {
  // What the sweeps leave for each other.
  struct Link {
    T wx, wy, wz;
    T d;  // of a slide
    T e;  // e+
    Sixfold<T> c, g;
  };
  struct Matrix {
    Rotation<T> R;
    T p[3];
  };
  // Of a link with several children: what they have summed up to, and l-.
  struct Branch {
    bool begun;
    Articulated<T> P;
    Sixfold<T> z, l;
    Size<T> size;
  };

  std::vector<Link> links;
  std::vector<T> angle, sin, cos;
  std::vector<Matrix> matrices;
  std::vector<Branch> branches;
  T margin;  // least D - net x size of the last call
  T check;   // zero where every acceleration was finite, else NaN

  template <class S>
  explicit StructuredWorkspace(const StructuredModel<S>& model)
      : links(model.nv()),
        angle((model.angles() + padding<T> - 1) / padding<T> * padding<T>, T(S(0))),
        sin(angle),
        cos(angle),
        matrices(model.matrices()),
        branches(model.slots()) {}
};

namespace detail {

// phi x of an heir or any child on a screw.
template <class T, class S, class C, class D>
[[gnu::always_inline]] inline void force_to_parent(const StructuredModel<S>& model,
                                                   const StructuredLink<S>& link,
                                                   const Direction<C>& joint, const D& d,
                                                   Sixfold<T>& z) {
  z.x = z.x - d * z.v;
  z.y = z.y + d * z.u;
  turn(joint, z.x, z.y, z.x, z.y);
  turn(joint, z.u, z.v, z.u, z.v);
  turn(link.alpha, z.y, z.z, z.y, z.z);
  turn(link.alpha, z.v, z.w, z.v, z.w);
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

// phi' l.
template <class T, class S, class C, class D>
[[gnu::always_inline]] inline void motion_from_parent(const StructuredModel<S>& model,
                                                      const StructuredLink<S>& link,
                                                      const Direction<C>& joint, const D& d,
                                                      Sixfold<T>& l) {
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
  if (link.turned) {
    turn_back(model.uncommon(link).theta, l.x, l.y);
    turn_back(model.uncommon(link).theta, l.u, l.v);
  }
  turn_back(link.alpha, l.y, l.z);
  turn_back(link.alpha, l.v, l.w);
  turn_back(joint, l.x, l.y);
  turn_back(joint, l.u, l.v);
  l.u = l.u + d * l.y;
  l.v = l.v - d * l.x;
}

// phi P+ phi'.
template <class T, class R, class L, class S, class C, class D>
[[gnu::always_inline]] inline Articulated<T> to_parent(const StructuredModel<S>& model,
                                                       const StructuredLink<S>& link,
                                                       const Turn<C>& joint, const D& d,
                                                       Articulated<T, R, L>& P_plus) {
  translate_z(d, P_plus);
  rotate_z(joint, P_plus);
  Articulated<T> P = rotate_x(link.alpha, P_plus);
  if (link.turned) rotate_z(model.uncommon(link).theta, P);
  translate_x(link.p[0], P);
  if (link.p[1] != S(0)) translate_y(link.p[1], P);
  if (link.p[2] != S(0)) translate_z(link.p[2], P);
  return P;
}

template <class T>
[[gnu::always_inline]] inline void force_to_parent(
    const typename StructuredWorkspace<T>::Matrix& phi, Sixfold<T>& z) {
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

// phi P+ phi' and phi z+.
template <class T>
[[gnu::noinline]] void to_parent(const typename StructuredWorkspace<T>::Matrix& phi,
                                 Articulated<T>& P, Sixfold<T>& z) {
  rotate(phi.R, P);
  translate_x(phi.p[0], P);
  translate_y(phi.p[1], P);
  translate_z(phi.p[2], P);
  force_to_parent(phi, z);
}

// R'x.
template <class T>
[[gnu::always_inline]] inline void turn_back(const Rotation<T>& by, T& x, T& y, T& z) {
  const auto& R = by.R;
  const T new_x = R[0][0] * x + R[1][0] * y + R[2][0] * z;
  const T new_y = R[0][1] * x + R[1][1] * y + R[2][1] * z;
  z = R[0][2] * x + R[1][2] * y + R[2][2] * z;
  x = new_x;
  y = new_y;
}

template <class T>
[[gnu::always_inline]] inline void motion_from_parent(
    const typename StructuredWorkspace<T>::Matrix& phi, Sixfold<T>& l) {
  const auto& p = phi.p;
  l.u -= p[1] * l.z - p[2] * l.y;
  l.v -= p[2] * l.x - p[0] * l.z;
  l.w -= p[0] * l.y - p[1] * l.x;
  turn_back(phi.R, l.x, l.y, l.z);
  turn_back(phi.R, l.u, l.v, l.w);
}

// R = E R(q) C or E C, p = p or p + E q, as model.hpp says.
template <class T, class S>
[[gnu::noinline]] void set_matrix(const StructuredLink<S>& link, const Matrix3<S>& E, const T* q,
                                  typename StructuredWorkspace<T>::Matrix& phi) {
  T X[3][3];
  for (int i = 0; i < 3; ++i) phi.p[i] = T(link.p[i]);
  if (link.coordinate == Coordinate::position) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        X[i][j] = T(E(i, j));
        phi.p[i] += X[i][j] * q[j];
      }
  } else {
    const T s = T(S(2)) / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
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
[[gnu::always_inline]] inline void centripetal(const StructuredLink<S>& link, const T& wx,
                                               const T& wy, const T& wz, Sixfold<T>& c) {
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

// w and c of a link on a screw, the joint's own motion apart, from w of the parent.
template <class T, class S, class C, class D>
[[gnu::always_inline]] inline void cross_outward(const StructuredModel<S>& model,
                                                 const StructuredLink<S>& link,
                                                 const Direction<C>& joint, const D& d, T& wx,
                                                 T& wy, T& wz, Sixfold<T>& c) {
  centripetal(link, wx, wy, wz, c);
  if (link.turned) {
    turn_back(model.uncommon(link).theta, wx, wy);
    turn_back(model.uncommon(link).theta, c.u, c.v);
  }
  turn_back(link.alpha, wy, wz);
  turn_back(link.alpha, c.v, c.w);
  turn_back(joint, wx, wy);
  turn_back(joint, c.u, c.v);
  const T dz = d * wz;
  c.u += dz * wx;
  c.v += dz * wy;
  c.w = c.w - d * (wx * wx + wy * wy);
}

// The same across a matrix.
template <class T>
[[gnu::noinline]] void cross_outward(const typename StructuredWorkspace<T>::Matrix& phi, T& wx,
                                     T& wy, T& wz, Sixfold<T>& c) {
  const T wp = wx * phi.p[0] + wy * phi.p[1] + wz * phi.p[2];
  const T ww = wx * wx + wy * wy + wz * wz;
  c.u = wx * wp - phi.p[0] * ww;
  c.v = wy * wp - phi.p[1] * ww;
  c.w = wz * wp - phi.p[2] * ww;
  turn_back(phi.R, c.u, c.v, c.w);
  turn_back(phi.R, wx, wy, wz);
}

// w and c of every link.
template <class T, class S>
void set_velocity(const StructuredModel<S>& model, const T* q, const T* qd,
                  StructuredWorkspace<T>& ws) {
  using Kind = typename StructuredLink<S>::Kind;
  const T zero = T(S(0)), two = T(S(2));
  T wx = zero, wy = zero, wz = zero;
  T ux = zero, uy = zero, uz = zero;  // w before the joint, for all DoF of a ball joint
  for (int k = 0; k < model.nv(); ++k) {
    const StructuredLink<S>& link = model.link(k);
    auto& at = ws.links[k];
    Sixfold<T> c = {zero, zero, zero, zero, zero, zero};
    if (!link.hangs_on_previous) {
      wx = wy = wz = zero;
      if (link.parent >= 0) {
        const auto& parent = ws.links[link.parent];
        wx = parent.wx;
        wy = parent.wy;
        wz = parent.wz;
      }
    }
    if (link.kind == Kind::screws) {
      if (link.slides) {
        at.d = q[link.q_index] + T(link.offset);
        if (link.parent >= 0)
          cross_outward(model, link, model.uncommon(link).turn, at.d, wx, wy, wz, c);
      } else if (link.parent >= 0) {
        cross_outward(model, link, Direction<T>{ws.cos[link.varying], ws.sin[link.varying]}, link.d,
                      wx, wy, wz, c);
      }
    } else if (link.kind == Kind::matrix) {
      auto& phi = ws.matrices[link.varying];
      set_matrix(link, model.uncommon(link).E, q + link.q_index, phi);
      if (link.parent >= 0) {
        T x = wx, y = wy, z = wz;  // w and c stay in registers
        Sixfold<T> turned;
        cross_outward(phi, x, y, z, turned);
        wx = x;
        wy = y;
        wz = z;
        c.u = turned.u;
        c.v = turned.v;
        c.w = turned.w;
      }
    } else {
      const T first = wx, first_u = ux;
      wx = wy;
      wy = wz;
      wz = first;
      ux = uy;
      uy = uz;
      uz = first_u;
    }
    if (link.kind != Kind::cyclic) {
      ux = wx;
      uy = wy;
      uz = wz;
    }
    if (link.slides) {
      const T twice = two * qd[k];
      c.u += twice * uy;
      c.v -= twice * ux;
    } else {
      c.x = qd[k] * uy;
      c.y = -(qd[k] * ux);
      wz += qd[k];
    }
    at.wx = wx;
    at.wy = wy;
    at.wz = wz;
    at.c = c;
  }
}

// b of a link alone is added to z, or written where z is new. 45 flops.
template <bool add, class T, class S>
[[gnu::always_inline]] inline void bias(const StructuredBody<S>& body, const T& wx, const T& wy,
                                        const T& wz, Sixfold<T>& z) {
  const T Lx = body.Ixx * wx + body.Ixy * wy + body.Ixz * wz;
  const T Ly = body.Ixy * wx + body.Iyy * wy + body.Iyz * wz;
  const T Lz = body.Ixz * wx + body.Iyz * wy + body.Izz * wz;
  const T wh = body.h[0] * wx + body.h[1] * wy + body.h[2] * wz;
  const T ww = wx * wx + wy * wy + wz * wz;
  const Sixfold<T> b = {wy * Lz - wz * Ly,        wz * Lx - wx * Lz,
                        wx * Ly - wy * Lx,        wx * wh - body.h[0] * ww,
                        wy * wh - body.h[1] * ww, wz * wh - body.h[2] * ww};
  if constexpr (add)
    kalmarm::add(z, b);
  else
    z = b;
}

// Across the joint of link k: D, g and e+ are kept, P- and z- become P+ and z+ in the parent's
// frame.
template <bool slides, bool noise, class T, class S>
[[gnu::always_inline]] inline void cross(const StructuredModel<S>& model,
                                         const StructuredLink<S>& link,
                                         const StructuredBody<S>& body, const T& tau,
                                         StructuredWorkspace<T>& ws,
                                         typename StructuredWorkspace<T>::Link& at,
                                         Articulated<T>& P, Sixfold<T>& z, Size<T>& size) {
  using Kind = typename StructuredLink<S>::Kind;
  using std::min;
  T D, inverse_D;
  Sixfold<T> g;
  auto P_plus = [&] {
    if constexpr (slides)
      return measure_slide<noise>(P, body.r, D, inverse_D, g);
    else
      return measure_turn<noise>(P, body.r, D, inverse_D, g);
  }();
  at.g = g;
  const T net = T(SingularityTest<S, 1>::net());
  ws.margin = min(ws.margin, T(D - net * (slides ? size.force : size.moment)));
  const T e = tau - (slides ? z.w : z.z);
  at.e = e * inverse_D;
  if (link.parent < 0) return;
  size.moment = P.Axx + P.Ayy + P.Azz;
  size.force = P.Cxx + P.Cyy + P.Czz;
  z.x += g.x * e;
  z.y += g.y * e;
  z.u += g.u * e;
  z.v += g.v * e;
  if (noise || slides) z.z += g.z * e;
  if (noise || !slides) z.w += g.w * e;
  add_times(P_plus, at.c, slides, z);
  if (!noise) (slides ? z.w : z.z) = tau;

  const T two = T(S(2));
  if (link.kind == Kind::screws) {
    if constexpr (slides) {
      const T reach = body.reach + two * two * at.d * at.d;
      size.moment = two * size.moment + reach * size.force;
      P = to_parent(model, link, model.uncommon(link).turn, at.d, P_plus);
      force_to_parent(model, link, model.uncommon(link).turn, at.d, z);
    } else {
      size.moment = two * size.moment + body.reach * size.force;
      const Turn<T> joint(ws.cos[link.varying], ws.sin[link.varying]);
      P = to_parent(model, link, joint, link.d, P_plus);
      force_to_parent(model, link, joint, link.d, z);
    }
  } else if (link.kind == Kind::cyclic) {
    P = cycle(P_plus.full());
    z = {z.z, z.x, z.y, z.w, z.u, z.v};
  } else {
    Articulated<T> rotated = P_plus.full();  // P and z stay in registers
    Sixfold<T> moved = z;
    const auto& phi = ws.matrices[link.varying];
    to_parent(phi, rotated, moved);
    const T pp = phi.p[0] * phi.p[0] + phi.p[1] * phi.p[1] + phi.p[2] * phi.p[2];
    size.moment = two * (size.moment + pp * size.force);
    P = rotated;
    z = moved;
  }
}

// D, g, e+ of every link.
template <class T, class S>
void filter(const StructuredModel<S>& model, const T* tau, StructuredWorkspace<T>& ws) {
  ws.margin = T(S(1));
  for (auto& branch : ws.branches) branch.begun = false;
  Articulated<T> P;
  Sixfold<T> z;
  Size<T> size;
  bool carried = false;  // P and z come from link k + 1
  for (int k = model.nv() - 1; k >= 0; --k) {
    const StructuredLink<S>& link = model.link(k);
    const StructuredBody<S>& body = model.body(k);
    auto& at = ws.links[k];
    const S trace_I = body.Ixx + body.Iyy + body.Izz + body.r, trace_m = S(3) * body.m + body.r;
    if (!carried) {
      set_body(body, P);
      size = {T(trace_I), T(trace_m)};
      bias<false>(body, at.wx, at.wy, at.wz, z);
    } else if (!link.massless) {
      add_body(body, P);
      size.moment += trace_I;
      size.force += trace_m;
      bias<true>(body, at.wx, at.wy, at.wz, z);
    }
    if (link.slot >= 0) {
      add(P, ws.branches[link.slot].P);
      add(z, ws.branches[link.slot].z);
      size.moment += ws.branches[link.slot].size.moment;
      size.force += ws.branches[link.slot].size.force;
    }
    if (link.slides) {
      if (link.noise)
        cross<true, true>(model, link, body, tau[k], ws, at, P, z, size);
      else
        cross<true, false>(model, link, body, tau[k], ws, at, P, z, size);
    } else {
      if (link.noise)
        cross<false, true>(model, link, body, tau[k], ws, at, P, z, size);
      else
        cross<false, false>(model, link, body, tau[k], ws, at, P, z, size);
    }
    carried = link.hangs_on_previous;
    if (link.parent < 0 || carried) continue;
    auto& branch = ws.branches[model.link(link.parent).slot];
    if (branch.begun) {
      add(branch.P, P);
      add(branch.z, z);
      branch.size.moment += size.moment;
      branch.size.force += size.force;
    } else {
      branch.P = P;
      branch.z = z;
      branch.size = size;
      branch.begun = true;
    }
  }
}

// l and a of every link.
template <class T, class S>
void smooth(const StructuredModel<S>& model, StructuredWorkspace<T>& ws, T* a) {
  using Kind = typename StructuredLink<S>::Kind;
  const T zero = T(S(0));
  Sixfold<T> l;
  ws.check = zero;
  for (int k = 0; k < model.nv(); ++k) {
    const StructuredLink<S>& link = model.link(k);
    const auto& at = ws.links[k];
    const auto& c = at.c;
    if (link.parent < 0)
      l = {zero,
           zero,
           zero,
           T(model.uncommon(link).a0[0]),
           T(model.uncommon(link).a0[1]),
           T(model.uncommon(link).a0[2])};
    else if (!link.hangs_on_previous)
      l = ws.branches[model.link(link.parent).slot].l;
    switch (link.kind) {
      case Kind::screws:
        if (link.slides)
          motion_from_parent(model, link, model.uncommon(link).turn, at.d, l);
        else
          motion_from_parent(model, link, Direction<T>{ws.cos[link.varying], ws.sin[link.varying]},
                             link.d, l);
        break;
      case Kind::matrix:
        motion_from_parent(ws.matrices[link.varying], l);
        break;
      case Kind::cyclic:
        l = {l.y, l.z, l.x, l.v, l.w, l.u};
        break;
    }
    l.u += c.u;
    l.v += c.v;
    l.w += c.w;
    if (!link.slides) {
      l.x += c.x;
      l.y += c.y;
    }
    const auto& g = at.g;
    const bool exact = !link.noise;
    if (link.slides) {
      const T rest = ((at.e - g.x * l.x - g.y * l.y) - g.z * l.z) - (g.u * l.u + g.v * l.v);
      a[k] = exact ? rest - l.w : rest - g.w * l.w;
      l.w = exact ? rest : l.w + a[k];
    } else {
      const T rest = ((at.e - g.x * l.x - g.y * l.y) - g.w * l.w) - (g.u * l.u + g.v * l.v);
      a[k] = exact ? rest - l.z : rest - g.z * l.z;
      l.z = exact ? rest : l.z + a[k];
    }
    ws.check += a[k] * zero;
    if (link.slot >= 0) ws.branches[link.slot].l = l;
  }
}

}  // namespace detail

// a (nv) from q (nq), qd (nv) and tau (nv), all numbers in T; ws.margin and ws.check say whether it
// can be believed.
template <class T, class S>
void structured_acceleration(const StructuredModel<S>& model, const T* q, const T* qd, const T* tau,
                             StructuredWorkspace<T>& ws, T* a) {
  for (int k = 0; k < model.nv(); ++k)
    if (const StructuredLink<S>& link = model.link(k); link.coordinate == Coordinate::angle)
      ws.angle[link.varying] = q[link.q_index] + T(link.offset);
  sin_cos(ws.angle, ws.sin, ws.cos);
  detail::set_velocity(model, q, qd, ws);
  detail::filter(model, tau, ws);
  detail::smooth(model, ws, a);
}

}  // namespace kalmarm
