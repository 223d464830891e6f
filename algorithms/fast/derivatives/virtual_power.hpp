// Derivatives of inverse dynamics tau = ID(q, q', q''), contracted with lambda: of
//   S = lambda'tau,  by q, q', q'', inertias, armatures r, forces from outside, loads and gravity        (1)
// in O(n), without a matrix, for one state or, with T a Pack, one state in every lane.
//
// lambda is a velocity of the joints. Let it give link k's origin the velocity u and the link the rate mu, both
// in the link's axes, as q'' gives a and alpha where nothing turns. With Gamma = alpha~ + w~w~ of
// rigid/inverse_dynamics.hpp, S is the power of all forces of inertia along it (d'Alembert), sums over bodies,
//   S = sum of integral of (u + mu x x)'(a + Gamma x) dm - sum of forces'J lambda + sum of r lambda q''       (2)
// (2) is bilinear in (mu; u) and (alpha, w~w~, a), so that what it gives per unit of a motion of link k is a force,
//   of (mu; u):     z = (n; f) of inverse dynamics
//   of (alpha; a):  y = M(k) (mu; u), the same forces of u for a                                             (3)
//   of w:           W = u (h'w) + h (u'w) - 2 (h'u) w + (I w) x mu + I (mu x w)                              (4)
// Inward, with o = origin of k from its parent's, in the parent's axes, z and y are moved by phi as forces are, and, since
// a(k) has w~w~o of the parent,
//   W(parent) += R W + f (o'w) + o (f'w) - 2 (o'f) w,  f: the linear half of R y,  w of the parent           (5)
// At a joint along e_z, once all that is outboard has arrived, [x, y] = (x cross y)_z, and l = lambda(k):
//   hinge:  dS/dq'' = y_alpha z + r l,  dS/dq' = W_z + [y_alpha, w]
//           dS/dq = [W, w] + [y_alpha, alpha] + [y_a, a] + [n, mu] + [f, u],  W += q' e_z x y_alpha          (6)
//   slide:  dS/dq'' = y_a z + r l,  dS/dq' = 2 [y_a, w],
//           dS/dq = y_a'Gamma e_z + [f, mu],  W += 2 q' e_z x y_a                                            (7)
// A ball joint with rates v, accelerations v' and l, three each, and w- = w - v of its inboard side, has as vectors
//   dS/dv' = y_alpha,  dS/dv = W + y_alpha x w-,  W += v x y_alpha,
//   dS/dq = W x w + y_alpha x alpha + y_a x a + n x mu + f x u + v x dS/dv + v' x y_alpha + l x n             (8)
// with W, w, alpha and mu of the outboard side. dS/dq is for a change along the joint's velocity, as derivatives.hpp has
// it. By the ten numbers (m, h, I) of a body whose frame has the pose (A, s) on its link, with u, a of that frame's origin,
//   dS/dm = u'a,  dS/dh = A'(Gamma'u + a x mu),  dS/dI = A' (tr K / 2 - (K + K') / 2) A,  K = mu~'Gamma        (9)
// and by a force (n; f) in the axes of a frame -(A'mu; A'u).
//
// Forward dynamics a = M^-1 (tau - bias) solves ID(q, q', a) = tau. With lambda = M^-1 w, by the filter and smoother that
// gave a,
//   w'da = lambda'dtau - dS at fixed lambda and a                                                           (10)
// and x = M^-1 tau of a robot that neither moves nor weighs anything likewise. Both are (1) of -lambda.
//
// Gravity g is an acceleration -g of the base, which its children have as -E0'g, E0 that of their placement:
//   dS/dg = -sum of E0 (R y)_a over children of the base                                                    (11)
//
// About 500 flops a hinge: 170 for the motions, 66 + 40 for (3), 85 for (4), 130 on the way to the parent.
#pragma once

#include <array>
#include <vector>

#include "algorithms/fast/kinematics/loads.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"

namespace kalmarm {

template <class T>
struct VirtualPowerWorkspace : Placements<T> {
  using S = typename Lanes<T>::Scalar;

  struct Link {
    T d;  // of a slide
  };
  // Of a link with several children, or that calls act on: its motion, and what they have summed up to.
  struct Branch {
    T wx, wy, wz;
    Sixfold<T> a, z, y;
    Triple<T> W;
  };
  struct Motion {
    Triple<T> w;
    Sixfold<T> a, u;  // (alpha; a), (mu; u)
  };
  // Of a ball joint: its last DoF, and the two before it.
  enum class Joint : char { hinge, slide, ball, of_ball };

  std::vector<Link> links;
  std::vector<Branch> branches;
  std::vector<Motion> motions;
  std::vector<Joint> joints;
  std::vector<Triple<S>> offsets,
      axes;  // o of links on screws, without a slide's d; e_z in the parent's axes
  const T* gravity = nullptr;   // as the last call's Acting has it
  std::array<T, 3> by_gravity;  // (11)

  explicit VirtualPowerWorkspace(const LoweredModel<S>& model)
      : Placements<T>(model),
        links(model.nv()),
        branches(model.branch_count()),
        motions(model.nv()) {
    int inner = 0;  // DoF of a ball joint that are left
    for (int k = 0; k < model.nv(); ++k) {
      const LoweredLink<S>& link = model.link(k);
      if (link.coordinate == Coordinate::quaternion) inner = 3;
      joints.push_back(link.slides ? Joint::slide
                       : inner > 1 ? Joint::of_ball
                       : inner > 0 ? Joint::ball
                                   : Joint::hinge);
      if (inner > 0) --inner;
      Triple<S> e = {S(0), -link.alpha.s, link.alpha.c};
      if (link.turned) turn(model.uncommon(link).theta, e.x, e.y, e.x, e.y);
      axes.push_back(e);
      offsets.push_back(Triple<S>{link.p[0], link.p[1], link.p[2]} +
                        (link.slides ? S(0) : link.d) * e);
    }
  }
};

// Where derivatives go, nv each.
template <class T>
struct JointAdjoints {
  T *q, *qd, *qdd;
};

namespace detail {

// f (o'w) + o (f'w) - 2 (o'f) w: of f'(w~w~o) by w. 31 flops.
template <class T, class O>
KALMARM_INLINE Triple<T> by_rate(const Triple<O>& o, const Triple<T>& f, const Triple<T>& w) {
  const T ow = o.x * w.x + o.y * w.y + o.z * w.z, fw = dot(f, w),
          of = o.x * f.x + o.y * f.y + o.z * f.z, twice = of + of;
  return {ow * f.x + o.x * fw - twice * w.x, ow * f.y + o.y * fw - twice * w.y,
          ow * f.z + o.z * fw - twice * w.z};
}

// (4)
template <class T, class S>
KALMARM_INLINE Triple<T> by_rate_of(const LoweredBody<S>& body, const Triple<T>& w,
                                    const Sixfold<T>& u) {
  const auto times_I = [&](const Triple<T>& x) {
    return Triple<T>{body.Ixx * x.x + body.Ixy * x.y + body.Ixz * x.z,
                     body.Ixy * x.x + body.Iyy * x.y + body.Iyz * x.z,
                     body.Ixz * x.x + body.Iyz * x.y + body.Izz * x.z};
  };
  const Triple<T> mu = {u.x, u.y, u.z}, linear = {u.u, u.v, u.w};
  return by_rate(Triple<S>{body.h[0], body.h[1], body.h[2]}, linear, w) + cross(times_I(w), mu) +
         times_I(cross(mu, w));
}

// R x of a link.
template <class T, class S, class U>
KALMARM_INLINE void turn_to_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                   const Placements<U>& placed, Triple<T>& x) {
  using Kind = typename LoweredLink<S>::Kind;
  if (link.kind == Kind::cyclic) {
    cycle(x.x, x.y, x.z);
  } else if (link.kind == Kind::matrix) {
    const auto& R = placed.matrices[link.varying].R.R;
    x = {R[0][0] * x.x + R[0][1] * x.y + R[0][2] * x.z,
         R[1][0] * x.x + R[1][1] * x.y + R[1][2] * x.z,
         R[2][0] * x.x + R[2][1] * x.y + R[2][2] * x.z};
  } else {
    if (link.slides)
      turn(model.uncommon(link).turn, x.x, x.y, x.x, x.y);
    else
      turn(placed.direction(link), x.x, x.y, x.x, x.y);
    tilt(link, x.y, x.z);
    if (link.turned) turn(model.uncommon(link).theta, x.x, x.y, x.x, x.y);
  }
}

template <class T>
KALMARM_INLINE Triple<T> angular(const Sixfold<T>& x) {
  return {x.x, x.y, x.z};
}
template <class T>
KALMARM_INLINE Triple<T> linear(const Sixfold<T>& x) {
  return {x.u, x.v, x.w};
}

// (8): of DoF k, the last of its joint; DoF k - 2 is along x of its axes, DoF k - 1 along y.
template <bool turning, class T>
KALMARM_NOINLINE void at_ball(int k, const T* qd, const T* qdd, const T* lambda,
                              const typename VirtualPowerWorkspace<T>::Motion& at,
                              const Sixfold<T>& z, const Sixfold<T>& y, Triple<T>& W,
                              const JointAdjoints<T>& out) {
  const auto of_joint = [k](const T* x) { return Triple<T>{x[k - 2], x[k - 1], x[k]}; };
  const auto put = [k](const Triple<T>& x, T* to) {
    to[k - 2] = x.x;
    to[k - 1] = x.y;
    to[k] = x.z;
  };
  const Triple<T> y_alpha = angular(y);
  put(y_alpha, out.qdd);
  Triple<T> dq = cross(y_alpha, angular(at.a)) + cross(linear(y), linear(at.a)) +
                 cross(angular(z), angular(at.u)) + cross(linear(z), linear(at.u)) +
                 cross(of_joint(qdd), y_alpha) + cross(of_joint(lambda), angular(z));
  if constexpr (turning) {
    const Triple<T> v = of_joint(qd), by_v = W + cross(y_alpha, at.w - v);
    put(by_v, out.qd);
    dq += cross(W, at.w) + cross(v, by_v);
    W += cross(v, y_alpha);
  }
  put(dq, out.q);
}

// (3) to (8) and (11); ws.branches have begun.
template <bool turning, class T, class S>
KALMARM_SWEEP void add_adjoints(const LoweredModel<S>& model, const T* qd, const T* qdd,
                                const T* lambda, VirtualPowerWorkspace<T>& ws,
                                const JointAdjoints<T>& out) {
  using Kind = typename LoweredLink<S>::Kind;
  using Joint = typename VirtualPowerWorkspace<T>::Joint;
  Sixfold<T> z, y;
  Triple<T> W;
  bool carried = false;  // they come from link k + 1
  ws.by_gravity = {T(S(0)), T(S(0)), T(S(0))};
  for (int k = model.nv() - 1; k >= 0; --k) {
    const LoweredLink<S>& link = model.link(k);
    const auto& at = ws.motions[k];
    Gradient<T, turning> G;
    set_gradient(at.w.x, at.w.y, at.w.z, at.a, G);
    if (!carried) {
      set_zero(z);
      set_zero(y);
      W = {T(S(0)), T(S(0)), T(S(0))};
    }
    if (!link.massless) {
      Sixfold<T> own;
      link_force(model.central(k), G, at.a.u, at.a.v, at.a.w, own);
      add(z, own);
      Gradient<T, false> U;
      set_gradient(at.w.x, at.w.y, at.w.z, at.u, U);
      link_force(model.central(k), U, at.u.u, at.u.v, at.u.w, own);
      add(y, own);
      if constexpr (turning) W += by_rate_of(model.body(k), at.w, at.u);
    }
    if (link.branch >= 0) {
      const auto& branch = ws.branches[link.branch];
      add(z, branch.z);
      add(y, branch.y);
      if constexpr (turning) W += branch.W;
    }
    const T &w_x = at.w.x, &w_y = at.w.y;
    switch (ws.joints[k]) {
      case Joint::hinge:  // (6)
        out.qdd[k] = y.z;
        out.q[k] = (y.x * at.a.y - y.y * at.a.x) + (y.u * at.a.v - y.v * at.a.u) +
                   (z.x * at.u.y - z.y * at.u.x) + (z.u * at.u.v - z.v * at.u.u);
        if constexpr (turning) {
          out.q[k] += W.x * w_y - W.y * w_x;
          out.qd[k] = W.z + (y.x * w_y - y.y * w_x);
          W.x -= qd[k] * y.y;
          W.y += qd[k] * y.x;
        }
        break;
      case Joint::slide:  // (7)
        out.qdd[k] = y.w;
        out.q[k] = (y.u * G.xz + y.v * G.yz) + (at.u.y * z.u - at.u.x * z.v);
        if constexpr (turning) {
          out.q[k] += y.w * G.zz;
          const T twice = qd[k] + qd[k], by_qd = y.u * w_y - y.v * w_x;
          out.qd[k] = by_qd + by_qd;
          W.x -= twice * y.v;
          W.y += twice * y.u;
        }
        break;
      case Joint::ball:
        at_ball<turning>(k, qd, qdd, lambda, at, z, y, W, out);
        break;
      case Joint::of_ball:
        break;
    }
    carried = link.hangs_on_previous;
    if (link.parent < 0) {  // (11)
      if constexpr (turning) {
        Triple<T> of_a = linear(y);
        turn_to_parent(model, link, ws, of_a);
        const auto& E0 = model.uncommon(link).E0;
        for (int i = 0; i < 3; ++i)
          ws.by_gravity[i] -= (T(E0(i, 0)) * of_a.x + T(E0(i, 1)) * of_a.y) + T(E0(i, 2)) * of_a.z;
      }
      continue;
    }
    force_to_parent(model, link, ws, ws.links[k].d, z);
    force_to_parent(model, link, ws, ws.links[k].d, y);
    if constexpr (turning) {  // (5)
      turn_to_parent(model, link, ws, W);
      const Triple<T>& w = ws.motions[link.parent].w;
      const Triple<S>& o = ws.offsets[k];
      if (link.kind == Kind::matrix) {
        const auto& p = ws.matrices[link.varying].p;
        W += by_rate(Triple<T>{p[0], p[1], p[2]}, linear(y), w);
      } else if (link.kind == Kind::screws && link.slides) {
        const T& d = ws.links[k].d;
        const Triple<S>& e = ws.axes[k];
        W += by_rate(Triple<T>{o.x + d * e.x, o.y + d * e.y, o.z + d * e.z}, linear(y), w);
      } else if (link.kind == Kind::screws) {
        W += by_rate(o, linear(y), w);
      }
    }
    if (carried) continue;
    auto& branch = ws.branches[model.link(link.parent).branch];
    add(branch.z, z);
    add(branch.y, y);
    if constexpr (turning) branch.W += W;
  }
}

}  // namespace detail

// (1) of lambda (nv) by q, q' and q'' (nv each). turning: with velocities and gravity, else qd is not looked at and its
// derivative not written. Forces are in the axes of their frames, with which they turn.
template <bool turning, class T, class S>
KALMARM_NOINLINE void virtual_power_adjoints(const LoweredModel<S>& model, const T* q, const T* qd,
                                             const T* qdd, const T* lambda,
                                             VirtualPowerWorkspace<T>& ws,
                                             const JointAdjoints<T>& out,
                                             const Acting<T>& acting = {}) {
  detail::set_placements(model, q, ws);
  ws.gravity = acting.gravity;
  detail::for_each_motion<turning>(model, qd, qdd, ws,
                                   [&ws](int k, const Triple<T>& w, const Gradient<T, turning>&,
                                         const Sixfold<T>& a) KALMARM_INLINE_LAMBDA {
                                     ws.motions[k].w = w;
                                     detail::assign(ws.motions[k].a, a);
                                   });
  detail::for_each_motion<false>(
      model, lambda, lambda, ws,
      [&ws](int k, const Triple<T>&, const Gradient<T, false>&, const Sixfold<T>& u)
          KALMARM_INLINE_LAMBDA { detail::assign(ws.motions[k].u, u); });
  detail::begin_sums(model, ws, acting, [](int, const detail::OnLink<T>&) {});
  for (auto& branch : ws.branches) {
    detail::set_zero(branch.y);
    branch.W = {T(S(0)), T(S(0)), T(S(0))};
  }
  detail::for_each_load(model, acting, [&](std::size_t, int k, const Load<T>& load) {
    auto& sum = ws.branches[model.link(k).branch];
    const auto& at = ws.motions[k];
    const Triple<T> still = {T(S(0)), T(S(0)), T(S(0))};
    detail::add_force_of_load(load.body, at.w, at.a, sum.z);
    detail::add_force_of_load(load.body, still, at.u, sum.y);
    if constexpr (turning) sum.W += detail::by_rate_of(load.body, at.w, at.u);
  });
  detail::add_adjoints<turning>(model, qd, qdd, lambda, ws, out);
  for (int k = 0; k < model.nv(); ++k)
    if (model.link(k).has_noise) out.qdd[k] += model.body(k).r * lambda[k];
}

}  // namespace kalmarm
