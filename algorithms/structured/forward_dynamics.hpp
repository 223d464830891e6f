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
#include "algorithms/structured/transforms.hpp"

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
  // Of a link with several children: what they have summed up to, and l-.
  struct Branch {
    bool begun;
    Articulated<T> P;
    Sixfold<T> z, l;
    Size<T> size;
  };

  std::vector<Link> links;
  std::vector<T> angle, sin, cos;
  std::vector<MatrixPlacement<T>> matrices;
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

template <class T, class S, class Workspace>
void set_angles(const StructuredModel<S>& model, const T* q, Workspace& ws) {
  for (int k = 0; k < model.nv(); ++k)
    if (const StructuredLink<S>& link = model.link(k); link.coordinate == Coordinate::angle)
      ws.angle[link.varying] = q[link.q_index] + T(link.offset);
  sin_cos(ws.angle, ws.sin, ws.cos);
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
  detail::set_angles(model, q, ws);
  detail::set_velocity(model, q, qd, ws);
  detail::filter(model, tau, ws);
  detail::smooth(model, ws, a);
}

}  // namespace kalmarm
