// Inverse dynamics by the fast path, for one state or, with T a Pack, one state in every lane.
//
// A material point x of a link, from its origin, has the acceleration a + Gamma x with
//   Gamma = alpha~ + w~w~                              a of the origin, alpha = w'           (1)
// Base to tips, all in the link's axes after the turn R' of its placement:
//   w(k)     = R'w(parent) + H' q'
//   alpha(k) = R'alpha(parent) + R'w(parent) x H' q' + H' q''                                (2)
//   a(k)     = R'(a + Gamma p)(parent) + d Gamma e_z        + 2 w x e_z q' + e_z q'' at a slide
// Points of a hinge's axis belong to both links, so that Gamma of either serves for d.
//   f = m (a + Gamma c),  n = integral of r x Gamma r dm                                     (3)
//   n_x = (Gamma J)zy - (Gamma J)yz  and so on          J = integral of r r' dm, r from c
// Tips to base:
//   z(k) = (n + c x f; f) + loads - what acts from outside + sum over children j of phi(k,j) z(j)    (1.1)
// with (3) of kinematics/loads.hpp of loads.
//   tau(k) = H(k) z(k) + r(k) q''(k)                                                         (1.4)
// a of the base is -gravity. M q'' alone is the same with w = 0 and gravity left out, `turning`
// false: Gamma is alpha~, whose diagonal is not computed with. The force on a body is its mass times one acceleration, as in
// model/inverse_dynamics.hpp. About 171 flops a hinge that is an aligned child, and its sine and
// cosine.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/fast/kinematics/loads.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

// Of a link: Gamma of (1), columns by name. Diagonal: T, or Zero where the link does not turn.
template <class T, class Diagonal = T>
struct AccelerationGradient {
  Diagonal xx;
  T xy, xz, yx;
  Diagonal yy;
  T yz, zx, zy;
  Diagonal zz;
};

template <class T, bool turning>
using Gradient = AccelerationGradient<T, std::conditional_t<turning, T, Zero>>;

namespace detail {

// (3), and z of the link alone. 66 flops.
template <class T, class D, class S>
KALMARM_INLINE void link_force(const CentralBody<S>& body, const AccelerationGradient<T, D>& G,
                               const T& au, const T& av, const T& aw, Sixfold<T>& z) {
  const S* const c = body.c;
  const T u = body.m * (au + c[0] * G.xx + c[1] * G.xy + c[2] * G.xz);
  const T v = body.m * (av + c[0] * G.yx + c[1] * G.yy + c[2] * G.yz);
  const T w = body.m * (aw + c[0] * G.zx + c[1] * G.zy + c[2] * G.zz);
  z.x = (G.zz - G.yy) * body.Jyz + (G.zx * body.Jxy - G.yx * body.Jxz) +
        (G.zy * body.Jyy - G.yz * body.Jzz) + (c[1] * w - c[2] * v);
  z.y = (G.xx - G.zz) * body.Jxz + (G.xy * body.Jyz - G.zy * body.Jxy) +
        (G.xz * body.Jzz - G.zx * body.Jxx) + (c[2] * u - c[0] * w);
  z.z = (G.yy - G.xx) * body.Jxy + (G.yz * body.Jxz - G.xz * body.Jyz) +
        (G.yx * body.Jxx - G.xy * body.Jyy) + (c[0] * v - c[1] * u);
  z.u = u;
  z.v = v;
  z.w = w;
}

}  // namespace detail

// The links' own forces by (3), from their motion, when they are asked for. Another T may work them
// out otherwise (certified/own_forces.hpp).
template <class T>
class OwnForces {
 public:
  template <class S>
  explicit OwnForces(const LoweredModel<S>& model) : links_(model.nv()) {}

  // Number by number: gcc keeps in memory what is assigned as a whole.
  template <class D>
  KALMARM_INLINE void keep(int k, const AccelerationGradient<T, D>& G, const Sixfold<T>& a) {
    Link& at = links_[k];
    if constexpr (std::is_same_v<D, T>) {
      at.Gamma.xx = G.xx;
      at.Gamma.yy = G.yy;
      at.Gamma.zz = G.zz;
    }
    at.Gamma.xy = G.xy;
    at.Gamma.xz = G.xz;
    at.Gamma.yx = G.yx;
    at.Gamma.yz = G.yz;
    at.Gamma.zx = G.zx;
    at.Gamma.zy = G.zy;
    at.u = a.u;
    at.v = a.v;
    at.w = a.w;
  }

  // After the last `keep`, before the first `force`.
  template <bool turning>
  void begin() {}

  template <bool turning, class S>
  KALMARM_INLINE void force(const LoweredModel<S>& model, int k, Sixfold<T>& z) const {
    const Link& at = links_[k];
    const auto& G = at.Gamma;
    if constexpr (turning) {
      detail::link_force(model.central(k), G, at.u, at.v, at.w, z);
    } else {
      const Gradient<T, false> still{{}, G.xy, G.xz, G.yx, {}, G.yz, G.zx, G.zy, {}};
      detail::link_force(model.central(k), still, at.u, at.v, at.w, z);
    }
  }

 private:
  struct Link {
    AccelerationGradient<T> Gamma;
    T u, v, w;  // acceleration of the origin
  };
  std::vector<Link> links_;
};

template <class T>
struct InverseDynamicsWorkspace : Placements<T> {
  struct Link {
    T d;  // of a slide
  };
  // Of a link with several children: its motion, and what they have summed up to.
  struct Branch {
    T wx, wy, wz;
    Sixfold<T> a;  // alpha, a
    Sixfold<T> z;
  };

  std::vector<Link> links;
  std::vector<Branch> branches;
  OwnForces<T> own;
  const T* gravity = nullptr;  // as the last call's Acting has it

  template <class S>
  explicit InverseDynamicsWorkspace(const LoweredModel<S>& model)
      : Placements<T>(model), links(model.nv()), branches(model.branch_count()), own(model) {}
};

namespace detail {

// (1)
template <class T>
KALMARM_INLINE void set_gradient(const T& wx, const T& wy, const T& wz, const Sixfold<T>& a,
                                 AccelerationGradient<T>& G) {
  const T xx = wx * wx, yy = wy * wy, zz = wz * wz, xy = wx * wy, xz = wx * wz, yz = wy * wz;
  G.xx = -(yy + zz);
  G.yy = -(xx + zz);
  G.zz = -(xx + yy);
  G.xy = xy - a.z;
  G.yx = xy + a.z;
  G.xz = xz + a.y;
  G.zx = xz - a.y;
  G.yz = yz - a.x;
  G.zy = yz + a.x;
}

template <class T>
KALMARM_INLINE void set_gradient(const T&, const T&, const T&, const Sixfold<T>& a,
                                 AccelerationGradient<T, Zero>& G) {
  G.xy = -a.z;
  G.yx = a.z;
  G.xz = a.y;
  G.zx = -a.y;
  G.yz = -a.x;
  G.zy = a.x;
}

// a += Gamma p of the parent, for a link on a screw.
template <class T, class D, class S>
KALMARM_INLINE void add_offset(const LoweredLink<S>& link, const AccelerationGradient<T, D>& G,
                               Sixfold<T>& a) {
  a.u = a.u + link.p[0] * G.xx;
  a.v = a.v + link.p[0] * G.yx;
  a.w = a.w + link.p[0] * G.zx;
  if (link.p[1] != S(0)) {
    a.u = a.u + link.p[1] * G.xy;
    a.v = a.v + link.p[1] * G.yy;
    a.w = a.w + link.p[1] * G.zy;
  }
  if (link.p[2] != S(0)) {
    a.u = a.u + link.p[2] * G.xz;
    a.v = a.v + link.p[2] * G.yz;
    a.w = a.w + link.p[2] * G.zz;
  }
}

// R' of w, alpha and a, for a link on a screw. Where w is zero it is left alone.
template <bool turning, class T, class S, class C>
KALMARM_INLINE void turn_motion(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                const Direction<C>& joint, T& wx, T& wy, T& wz, Sixfold<T>& a) {
  if (link.turned) {
    const auto& theta = model.uncommon(link).theta;
    if constexpr (turning) turn_back(theta, wx, wy);
    turn_back(theta, a.x, a.y);
    turn_back(theta, a.u, a.v);
  }
  if constexpr (turning) tilt_back(link, wy, wz);
  tilt_back(link, a.y, a.z);
  tilt_back(link, a.v, a.w);
  if constexpr (turning) turn_back(joint, wx, wy);
  turn_back(joint, a.x, a.y);
  turn_back(joint, a.u, a.v);
}

// The same across a matrix, Gamma p included.
template <bool turning, class T>
KALMARM_NOINLINE void turn_motion(const MatrixPlacement<T>& phi, T& wx, T& wy, T& wz,
                                  Sixfold<T>& a) {
  Gradient<T, turning> G;
  set_gradient(wx, wy, wz, a, G);
  a.u += phi.p[0] * G.xx + phi.p[1] * G.xy + phi.p[2] * G.xz;
  a.v += phi.p[0] * G.yx + phi.p[1] * G.yy + phi.p[2] * G.yz;
  a.w += phi.p[0] * G.zx + phi.p[1] * G.zy + phi.p[2] * G.zz;
  if constexpr (turning) turn_back(phi.R, wx, wy, wz);
  turn_back(phi.R, a.x, a.y, a.z);
  turn_back(phi.R, a.u, a.v, a.w);
}

// keep(k, w of the link, Gamma, (alpha, a)) of every link; turning: with velocities and gravity. ws: placements, links
// and branches, as InverseDynamicsWorkspace has them.
template <bool turning, class T, class S, class Workspace, class Keep>
KALMARM_INLINE void for_each_motion(const LoweredModel<S>& model, const T* qd, const T* qdd,
                                    Workspace& ws, const Keep& keep) {
  using Kind = typename LoweredLink<S>::Kind;
  const T zero = T(S(0)), two = T(S(2));
  T wx = zero, wy = zero, wz = zero;
  T ux = zero, uy = zero, uz = zero;  // w before the joint, for all DoF of a ball joint
  Sixfold<T> a = {zero, zero, zero, zero, zero, zero};
  Gradient<T, turning> G;
  set_gradient(wx, wy, wz, a, G);
  for (int k = 0; k < model.nv(); ++k) {
    const LoweredLink<S>& link = model.link(k);
    auto& at = ws.links[k];
    if (link.parent < 0) {
      wx = wy = wz = zero;
      a.x = a.y = a.z = zero;
      if constexpr (turning) {
        const Triple<T> a0 = base_acceleration(model.uncommon(link), ws.gravity);
        a.u = a0.x;
        a.v = a0.y;
        a.w = a0.z;
      } else {
        a.u = a.v = a.w = zero;
      }
      set_gradient(wx, wy, wz, a, G);
    } else if (!link.hangs_on_previous) {
      const auto& parent = ws.branches[model.link(link.parent).branch];
      wx = parent.wx;
      wy = parent.wy;
      wz = parent.wz;
      assign(a, parent.a);
      set_gradient(wx, wy, wz, a, G);
    }
    if (link.kind == Kind::screws) {
      add_offset(link, G, a);
      if (link.slides)
        turn_motion<turning>(model, link, model.uncommon(link).turn, wx, wy, wz, a);
      else
        turn_motion<turning>(model, link, ws.direction(link), wx, wy, wz, a);
    } else if (link.kind == Kind::matrix) {
      T x = wx, y = wy, z = wz;  // w and a stay in registers
      Sixfold<T> turned;
      assign(turned, a);
      turn_motion<turning>(ws.matrices[link.varying], x, y, z, turned);
      wx = x;
      wy = y;
      wz = z;
      assign(a, turned);
    } else {
      cycle_back(wx, wy, wz);
      cycle_back(ux, uy, uz);
      cycle_back(a.x, a.y, a.z);
      cycle_back(a.u, a.v, a.w);
    }
    if (link.kind != Kind::cyclic) {
      ux = wx;
      uy = wy;
      uz = wz;
    }
    if constexpr (turning) {
      if (link.slides) {
        const T twice = two * qd[k];
        a.u += twice * uy;
        a.v -= twice * ux;
      } else {
        a.x += qd[k] * uy;
        a.y -= qd[k] * ux;
        wz += qd[k];
      }
    }
    if (link.slides)
      a.w += qdd[k];
    else
      a.z += qdd[k];
    if constexpr (turning) normalise(wx, wy, wz);
    normalise(a.x, a.y, a.z);
    set_gradient(wx, wy, wz, a, G);
    if (link.kind == Kind::screws) {
      const T d = link.slides ? at.d : T(link.d);
      a.u += d * G.xz;
      a.v += d * G.yz;
      a.w = a.w + d * G.zz;
    }
    normalise(a.u, a.v, a.w);
    keep(k, Triple<T>{wx, wy, wz}, G, a);
    if (link.branch >= 0) {
      auto& branch = ws.branches[link.branch];
      branch.wx = wx;
      branch.wy = wy;
      branch.wz = wz;
      assign(branch.a, a);
    }
  }
}

// z of every link alone. Not in pairs: filter.hpp says why.
template <bool turning, class T, class S>
KALMARM_SWEEP void set_link_forces(const LoweredModel<S>& model, const T* qd, const T* qdd,
                                   InverseDynamicsWorkspace<T>& ws) {
  for_each_motion<turning>(
      model, qd, qdd, ws,
      [&ws](int k, const Triple<T>&, const Gradient<T, turning>& G, const Sixfold<T>& a)
          KALMARM_INLINE_LAMBDA { ws.own.keep(k, G, a); });
}

// tau from z of every link alone, where the sums over children have begun. Not in pairs either.
template <bool turning, class T, class S>
KALMARM_SWEEP void add_forces(const LoweredModel<S>& model, const T* qdd,
                              InverseDynamicsWorkspace<T>& ws, T* tau) {
  ws.own.template begin<turning>();
  Sixfold<T> z;
  bool carried = false;  // z comes from link k + 1
  for (int k = model.nv() - 1; k >= 0; --k) {
    const LoweredLink<S>& link = model.link(k);
    const auto& at = ws.links[k];
    Sixfold<T> own;
    ws.own.template force<turning>(model, k, own);
    if (carried)
      add(z, own);
    else
      assign(z, own);
    if (link.branch >= 0) add(z, ws.branches[link.branch].z);
    normalise(z.x, z.y, z.z);
    normalise(z.u, z.v, z.w);
    tau[k] = link.slides ? z.w : z.z;
    if (link.has_noise) tau[k] += model.body(k).r * qdd[k];
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    force_to_parent(model, link, ws, at.d, z);
    if (!carried) add(ws.branches[model.link(link.parent).branch].z, z);
  }
}

// What loads need is added to the sums, once the links' motions are known.
template <class T, class S>
void add_forces_of_loads(const LoweredModel<S>& model, const Acting<T>& acting,
                         InverseDynamicsWorkspace<T>& ws) {
  for_each_load(model, acting, [&](std::size_t, int link, const Load<T>& load) {
    auto& sum = ws.branches[model.link(link).branch];
    add_force_of_load(load.body, Triple<T>{sum.wx, sum.wy, sum.wz}, sum.a, sum.z);
  });
}

// The same, with what acts from outside and loads.
template <bool turning, class T, class S>
void sum_forces(const LoweredModel<S>& model, const T* qdd, InverseDynamicsWorkspace<T>& ws, T* tau,
                const Acting<T>& acting = {}) {
  begin_sums(model, ws, acting, [](int, const OnLink<T>&) {});
  add_forces_of_loads(model, acting, ws);
  add_forces<turning>(model, qdd, ws, tau);
}

// tau = M x with loads, or H x by (3) of covariance/contacts.hpp, at the placements in ws; rows: (link, w) of
// contacts.
template <class T, class S, class Rows>
void mass_times(const LoweredModel<S>& model, const T* x, const Rows& rows, const Acting<T>& loads,
                InverseDynamicsWorkspace<T>& ws, T* tau) {
  set_link_forces<false>(model, x, x, ws);
  for (auto& branch : ws.branches) set_zero(branch.z);
  add_forces_of_loads(model, loads, ws);
  for (const auto& [link, w] : rows) {
    auto& branch = ws.branches[model.link(link).branch];
    const Sixfold<T>& l = branch.a;
    T by = (w.x * l.x + w.y * l.y + w.z * l.z) + (w.u * l.u + w.v * l.v + w.w * l.w);
    normalise(by);
    add(branch.z, Sixfold<T>{w.x * by, w.y * by, w.z * by, w.u * by, w.v * by, w.w * by});
  }
  add_forces<false>(model, x, ws, tau);
}

}  // namespace detail

// tau (nv) from q (nq), qd and qdd (nv), and what acts from outside, all numbers in T.
template <class T, class S>
void fast_inverse_dynamics(const LoweredModel<S>& model, const T* q, const T* qd, const T* qdd,
                           InverseDynamicsWorkspace<T>& ws, T* tau, const Acting<T>& acting = {}) {
  detail::set_placements(model, q, ws);
  ws.gravity = acting.gravity;
  detail::set_link_forces<true>(model, qd, qdd, ws);
  detail::sum_forces<true>(model, qdd, ws, tau, acting);
}

}  // namespace kalmarm
