// Forward dynamics by the structured form of the conventional filter and smoother (sweeps.hpp), for
// one state or, with T a Pack, one state in every lane.
//
// Accelerations are those of the material point at the link's origin, v' + w x v of the spatial
// form: the linear velocity then drops out. With W = w~w~ of the link, base to tips:
//   w(k) = R'w(parent) + H' q'                            its angular velocity
//   c(k) = (R'w x H' q';  R'W(parent) p + d W e_z)        at a hinge; W as it is before and after
//   c(k) = (0;            R'W(parent) p + d W e_z + 2 w x e_z q')         at a slide
//   b(k) = (w x I w;  W h)                                h = m c: bias of the link alone
// tips to base, with P of articulated.hpp; z- begins at minus what acts from outside (kinematics/acting.hpp), P and z-
// with loads (kinematics/loads.hpp) as with any other body:
//   e = tau - H z-,  e+ = e / D                                            (4.2), (4.6)
//   z+ = z- + g e + P+ c,  H z+ = (H g) tau + (r / D) H z- + H P+ c        (4.5)
//   z-(parent) += phi z+                                                   (4.4)
// base to tips:
//   l+ = phi' l-(parent) + c,  a = e+ - g' l+,  l- = l+ + H' a             (4.10), (4.9), (4.11)
// Where r = 0, H l- = e+ - sum over j != h of g_j l+_j. About 469 flops an aligned hinge
// (lowered_model.hpp) without zero terms, and its sine and cosine: with |a|^2, N and E of
// force_noise.hpp, which say how far rounding can have moved a.
//
// States with joint noise of their own have r(k) in every lane, in place of the model's: it enters
// D and P+ alone (measurement.hpp), r / D above, and the scales of the answer,
//   mu(k) >= r(k),  T = sum over k of 1 / mu(k)           (1) of least_inertia.hpp, (6) of force_noise.hpp
// which then are a lane's own too.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/fast/covariance/added_loads.hpp"
#include "algorithms/fast/covariance/filter.hpp"
#include "algorithms/fast/covariance/force_noise.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class T>
struct CovarianceWorkspace : Placements<T> {
  // Passed from sweep to sweep.
  struct Link {
    T wx, wy, wz;
    T d;  // of a slide
    T e;  // e+
    T inverse_D;
    Sixfold<T> c, g;
  };
  // Of a link with several children: the sum over them, and l-.
  struct Branch {
    Articulated<T> P;
    Sixfold<T> z, l;
    HandedOn<T> pending;
  };

  std::vector<Link> links;
  std::vector<Branch> branches;
  std::optional<ForceNoise<T>> forces;  // where the model's rounding depends on the state
  std::vector<Sixfold<T>> z;            // z-, of one state or where there are forces; else none
  std::vector<Load<T>> loads;           // on their links
  bool loaded = false;                  // the last call had them
  const T* gravity = nullptr;           // as the last call's Acting has it
  // Of the last call:
  T margin;    // of D (rounding_test.hpp)
  T noise;     // N of force_noise.hpp
  T energy;    // E of force_noise.hpp
  T squares;   // |a|^2; not finite where an acceleration is not
  T size;      // |a|_s^2, in each joint's own scale (least_inertia.hpp)
  T rounding;  // R of (12) of force_noise.hpp
  T trace;  // T of force_noise.hpp, where there are forces or states have joint noise of their own

  template <class S>
  explicit CovarianceWorkspace(const LoweredModel<S>& model)
      : Placements<T>(model), links(model.nv()), branches(model.branch_count()) {
    if (model.rounding_depends_on_state()) forces.emplace(model);
    if (Lanes<T>::count == 1 || forces) z.resize(model.nv());
    loads.resize(model.loaded().size());
  }
};

namespace detail {

// w and c of a joint in one block step: c of its first DoF, w of its last (three_axes.hpp).
template <class T, class S>
KALMARM_NOINLINE void set_joint_velocity(const LoweredModel<S>& model, const LinkRun& run,
                                         const T* qd, CovarianceWorkspace<T>& ws) {
  const T zero = T(S(0)), two = T(S(2));
  const int parent = model.link(run.first).parent;
  T wx = zero, wy = zero, wz = zero;
  if (parent >= 0) {
    wx = ws.links[parent].wx;
    wy = ws.links[parent].wy;
    wz = ws.links[parent].wz;
  }
  for (int k = run.first; k <= run.last; k += 3) {
    const LoweredLink<S>& link = model.link(k);
    Sixfold<T> c = {zero, zero, zero, zero, zero, zero};
    if (parent >= 0) cross_outward(ws.matrices[link.varying], wx, wy, wz, c);
    const T qx = qd[k + 1], qy = qd[k + 2], qz = qd[k];
    const T x = wy * qz - wz * qy, y = wz * qx - wx * qz, z = wx * qy - wy * qx;
    if (link.slides) {
      c.u += two * x;
      c.v += two * y;
      c.w += two * z;
    } else {
      c.x = x;
      c.y = y;
      c.z = z;
      wx += qx;
      wy += qy;
      wz += qz;
    }
    ws.links[k].c = c;
    for (int i = 0; i < 2; ++i) cycle_back(wx, wy, wz);
  }
  auto& last = ws.links[run.last];
  last.wx = wx;
  last.wy = wy;
  last.wz = wz;
}

// w and c of links one by one.
template <class T, class S>
KALMARM_NOINLINE void set_link_velocities(const LoweredModel<S>& model, const LinkRun& run,
                                          const T* qd, CovarianceWorkspace<T>& ws) {
  using Kind = typename LoweredLink<S>::Kind;
  const T zero = T(S(0)), two = T(S(2));
  T wx = zero, wy = zero, wz = zero;
  T ux = zero, uy = zero, uz = zero;  // w before the joint, for all DoF of a ball joint
  for (int k = run.first; k <= run.last; ++k) {
    const LoweredLink<S>& link = model.link(k);
    auto& at = ws.links[k];
    Sixfold<T> c = {zero, zero, zero, zero, zero, zero};
    if (!link.hangs_on_previous || k == run.first) {
      wx = wy = wz = zero;
      if (link.parent >= 0) {
        const auto& parent = ws.links[link.parent];
        wx = parent.wx;
        wy = parent.wy;
        wz = parent.wz;
      }
    }
    if (link.kind == Kind::screws) {
      if (link.parent >= 0 && link.slides)
        cross_outward(model, link, model.uncommon(link).turn, at.d, wx, wy, wz, c);
      else if (link.parent >= 0)
        cross_outward(model, link, Direction<T>{ws.cos[link.varying], ws.sin[link.varying]}, link.d,
                      wx, wy, wz, c);
    } else if (link.kind == Kind::matrix) {
      if (link.parent >= 0) {
        T x = wx, y = wy, z = wz;  // w and c stay in registers
        Sixfold<T> turned;
        cross_outward(ws.matrices[link.varying], x, y, z, turned);
        wx = x;
        wy = y;
        wz = z;
        c.u = turned.u;
        c.v = turned.v;
        c.w = turned.w;
      }
    } else {
      cycle_back(wx, wy, wz);
      cycle_back(ux, uy, uz);
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

// w and c of every link.
template <class T, class S>
void set_velocity(const LoweredModel<S>& model, const T* qd, CovarianceWorkspace<T>& ws) {
  for (const LinkRun& run : model.runs()) {
    if (run.at_once)
      set_joint_velocity(model, run, qd, ws);
    else
      set_link_velocities(model, run, qd, ws);
  }
}

// b of a link alone is added to z, or written where z is new, and its share to N. 53 flops.
template <bool add, class T, class S>
KALMARM_INLINE void bias(const LoweredBody<S>& body, const T& wx, const T& wy, const T& wz,
                         Sixfold<T>& z, T& noise) {
  const T Lx = body.Ixx * wx + body.Ixy * wy + body.Ixz * wz;
  const T Ly = body.Ixy * wx + body.Iyy * wy + body.Iyz * wz;
  const T Lz = body.Ixz * wx + body.Iyz * wy + body.Izz * wz;
  const T hx = body.h[0] * wx, hy = body.h[1] * wy, hz = body.h[2] * wz;
  const T xx = wx * wx, yy = wy * wy, zz = wz * wz;
  const Sixfold<T> b = {wy * Lz - wz * Ly,  // no squares that cancel in W h
                        wz * Lx - wx * Lz,
                        wx * Ly - wy * Lx,
                        wx * (hy + hz) - body.h[0] * (yy + zz),
                        wy * (hx + hz) - body.h[1] * (xx + zz),
                        wz * (hx + hy) - body.h[2] * (xx + yy)};
  const T ww = xx + yy + zz;
  noise += body.weights.bias * (ww * ww);
  if constexpr (add)
    kalmarm::add(z, b);
  else
    z = b;
}

// The share of link k in N. Sums of one state are made afterwards, several links at once, and all that
// depend on the state.
template <class T, class S>
KALMARM_INLINE void watch(const LoweredModel<S>& model, int k, const Sixfold<T>& z,
                          CovarianceWorkspace<T>& ws) {
  if (Lanes<T>::count == 1 || ws.forces)
    ws.z[k] = z;
  else if (model.body(k).weights.counts)
    ws.noise += absorbed(model.body(k).weights, z);
}

// The forces that the filter carries along: e+ of every link is kept.
template <class T, class S>
struct BiasedForces {
  using Load = Sixfold<T>;

  const LoweredModel<S>& model;
  const T* tau;
  CovarianceWorkspace<T>& ws;
  Acting<T> acting = {};

  void begin_all() const { begin_given<false>(); }
  static constexpr bool has_done(int) { return false; }
  T squared_rate(int k) const {
    const auto& at = ws.links[k];
    return at.wx * at.wx + at.wy * at.wy + at.wz * at.wz;
  }

  KALMARM_INLINE void begin(int k, Load& z) const {
    const auto& at = ws.links[k];
    bias<false>(model.body(k), at.wx, at.wy, at.wz, z, ws.noise);
  }
  KALMARM_INLINE void add_body(int k, Load& z) const {
    const auto& at = ws.links[k];
    bias<true>(model.body(k), at.wx, at.wy, at.wz, z, ws.noise);
  }
  KALMARM_INLINE void add_branch(int index, Load& z) const { add(z, ws.branches[index].z); }
  KALMARM_INLINE void keep(int index, const Load& z) const { add(ws.branches[index].z, z); }

  template <bool slides, bool noise, class P_plus>
  KALMARM_INLINE void measured(int k, const Sixfold<T>& g, const T& inverse_D, const P_plus& P,
                               Load& z) const {
    watch(model, k, z, ws);
    auto& at = ws.links[k];
    at.inverse_D = inverse_D;
    at.e = gain<slides, noise>(g, T(model.body(k).r * inverse_D), tau[k], z) * inverse_D;
    add_times(z, P, at.c, slides);
  }

  template <class C, class D>
  KALMARM_INLINE void to_parent(const LoweredLink<S>& link, const Direction<C>& joint, const D& d,
                                Load& z) const {
    force_to_parent(model, link, joint, d, z);
  }
  void to_parent(const MatrixPlacement<T>& phi, Load& z) const {
    Load moved = z;  // z stays in registers
    far_force_to_parent(phi, moved);
    z = moved;
  }
  KALMARM_INLINE void cycle(Load& z) const { z = kalmarm::cycle(z); }

 protected:
  // What acts from outside, and loads; at rest these have no bias.
  template <bool at_rest>
  void begin_given() const {
    begin_sums(model, ws, acting,
               [&](int k, const OnLink<T>& on) { charge(k, on.moments, on.forces); });
    ws.loaded = acting.loads != nullptr;
    ws.gravity = acting.gravity;
    T squared_gravity = T(model.squared_gravity());
    if (acting.gravity) {
      const Triple<T> given = three(acting.gravity);
      squared_gravity = dot(given, given);
      ws.energy += squared_gravity * T(model.mass());
    }
    add_loads(model, acting, ws, [&](std::size_t i, int k, const kalmarm::Load<T>& load) {
      ws.loads[i] = load;
      ws.energy += squared_gravity * load.body.m;
      if constexpr (!at_rest) {
        const auto& at = ws.links[k];
        bias<true>(load.body, at.wx, at.wy, at.wz, ws.branches[model.link(k).branch].z, ws.noise);
        const T ww = squared_rate(k), wwww = ww * ww;
        charge(k, load.moment * load.moment * wwww, load.force * load.moment * wwww);
      }
    });
  }

 private:
  // Rounding of a force on link k, from its squares by (13) of force_noise.hpp.
  void charge(int k, const T& moments, const T& forces) const {
    const RoundingWeights<S>& w = model.body(k).weights;
    if (ws.forces)
      ws.forces->charge_acting(k, moments, forces);
    else
      ws.noise += w.moment * moments + w.force * forces;
  }
};

// The same with joint noise of every lane.
template <class T, class S>
struct NoisyForces : BiasedForces<T, S> {
  using typename BiasedForces<T, S>::Load;

  const T* noises;

  KALMARM_INLINE const T& r(int k) const { return noises[k]; }

  template <bool slides, bool noise, class P_plus>
  KALMARM_INLINE void measured(int k, const Sixfold<T>& g, const T& inverse_D, const P_plus& P,
                               Load& z) const {
    watch(this->model, k, z, this->ws);
    auto& at = this->ws.links[k];
    at.inverse_D = inverse_D;
    const T kept = noises[k] * inverse_D;
    at.e = gain<slides, noise>(g, kept, this->tau[k], z) * inverse_D;
    add_times(z, P, at.c, slides);
  }
};

// D, g, e+ of every link, and N, by the policy of forces; E is begun.
template <class T, class S, class Forces>
void filter_forces(const LoweredModel<S>& model, CovarianceWorkspace<T>& ws, const Forces& forces) {
  ws.noise = ws.energy = T(S(0));
  if (ws.forces) ws.forces->begin();
  filter<T>(model, ws, forces);
  if (ws.forces) {
    for (int k = model.nv() - 1; k >= 0; --k) {
      ws.forces->charge_bias(model, k, forces.squared_rate(k));
      ws.noise += ws.forces->charge(model, ws, k, ws.z[k]);
    }
  } else if constexpr (Lanes<T>::count == 1) {
    ws.noise += force_noise(model, ws.z);
  }
}

// l- of the parent, where that is not the link before.
template <class T, class S>
KALMARM_INLINE void begin_motion(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                 const CovarianceWorkspace<T>& ws, Sixfold<T>& l) {
  const T zero = T(S(0));
  if (link.parent < 0) {
    const Triple<T> a0 = base_acceleration(model.uncommon(link), ws.gravity);
    l = {zero, zero, zero, a0.x, a0.y, a0.z};
  } else if (!link.hangs_on_previous) {
    l = ws.branches[model.link(link.parent).branch].l;
  }
}

// l and a of a joint in one block step; at rest c is zero, and is not read.
template <bool at_rest, class T, class S>
KALMARM_NOINLINE void smooth_joint(const LoweredModel<S>& model, const LinkRun& run,
                                   CovarianceWorkspace<T>& ws, Sixfold<T>& from, T* a) {
  Sixfold<T> l = from;
  T squares = ws.squares, size = ws.size, energy = ws.energy;
  T rounding = ws.rounding;
  begin_motion(model, model.link(run.first), ws, l);
  for (int first = run.first; first <= run.last; first += 3) {
    const LoweredLink<S>& link = model.link(first);
    motion_from_parent(ws.matrices[link.varying], l);
    if constexpr (!at_rest) add(l, ws.links[first].c);
    for (int k = first; k < first + 3; ++k) {
      if (k > first) {
        cycle_back(l.x, l.y, l.z);
        cycle_back(l.u, l.v, l.w);
      }
      const auto& at = ws.links[k];
      energy += motion_noise(link, at.g, at.inverse_D, at.e, l);
      a[k] = smooth(link, at.g, at.e, l);
      const T square = a[k] * a[k];
      squares += square;
      size += model.least_inertias()[k] * square;
      rounding += model.largest_inertias()[k] * square;
    }
  }
  if (const int index = model.link(run.last).branch; index >= 0) ws.branches[index].l = l;
  ws.squares = squares;
  ws.size = size;
  ws.rounding = rounding;
  ws.energy = energy;
  from = l;
}

// l and a of links one by one, likewise.
template <bool at_rest, class T, class S>
KALMARM_NOINLINE void smooth_links(const LoweredModel<S>& model, const LinkRun& run,
                                   CovarianceWorkspace<T>& ws, Sixfold<T>& from, T* a) {
  Sixfold<T> l = from;
  T squares = ws.squares, size = ws.size, energy = ws.energy;
  T rounding = ws.rounding;
  for (int k = run.first; k <= run.last; ++k) {
    const LoweredLink<S>& link = model.link(k);
    const auto& at = ws.links[k];
    begin_motion(model, link, ws, l);
    motion_from_parent(model, link, ws, at.d, l);
    if constexpr (!at_rest) {
      const auto& c = at.c;
      l.u += c.u;
      l.v += c.v;
      l.w += c.w;
      if (!link.slides) {
        l.x += c.x;
        l.y += c.y;
      }
    }
    energy += motion_noise(link, at.g, at.inverse_D, at.e, l);
    a[k] = smooth(link, at.g, at.e, l);
    const T square = a[k] * a[k];
    squares += square;
    size += model.least_inertias()[k] * square;
    rounding += model.largest_inertias()[k] * square;
    if (link.branch >= 0) ws.branches[link.branch].l = l;
  }
  ws.squares = squares;
  ws.size = size;
  ws.rounding = rounding;
  ws.energy = energy;
  from = l;
}

// What loads add to the largest that M(k,k) can be, for R of (12) of force_noise.hpp.
template <class T, class S>
void add_rounding_of_loads(const LoweredModel<S>& model, const T* a, CovarianceWorkspace<T>& ws) {
  for (std::size_t i = 0; i < ws.loads.size(); ++i) {
    const LoweredFrame<S>& frame = model.loaded()[i];
    const LoweredBody<T>& body = ws.loads[i].body;
    const T polar = body.Ixx + body.Iyy + body.Izz;
    for (std::size_t j = 0; j < frame.way.size(); ++j) {
      const int k = frame.way[j];
      if (!(frame.reach[j] < std::numeric_limits<S>::infinity())) continue;
      const T away = T(frame.reach[j] * frame.reach[j]) * body.m;
      ws.rounding += (model.link(k).slides ? body.m : T(polar + away + away)) * (a[k] * a[k]);
    }
  }
}

// l and a of every link, |a|^2, |a|_s^2, R, and what motions add to E.
template <bool at_rest = false, class T, class S>
void smooth(const LoweredModel<S>& model, CovarianceWorkspace<T>& ws, T* a) {
  Sixfold<T> l;
  ws.squares = ws.size = ws.rounding = T(S(0));
  for (const LinkRun& run : model.runs()) {
    if (run.at_once)
      smooth_joint<at_rest>(model, run, ws, l, a);
    else
      smooth_links<at_rest>(model, run, ws, l, a);
  }
  if (ws.loaded) add_rounding_of_loads(model, a, ws);
  if (!ws.forces) return;
  ws.trace = ws.forces->trace(model, ws);
  ws.size = T(S(0));
  for (int k = 0; k < model.nv(); ++k) ws.size += a[k] * a[k] / ws.forces->variance(k);
}

}  // namespace detail

// a (nv) from q (nq), qd (nv), tau (nv) and what acts from outside, all numbers in T; ws.margin, ws.noise,
// ws.energy, ws.squares and ws.size say how wrong it may be (engine/acceptance.hpp).
template <class T, class S>
void covariance_acceleration(const LoweredModel<S>& model, const T* q, const T* qd, const T* tau,
                             CovarianceWorkspace<T>& ws, T* a, const Acting<T>& acting = {}) {
  detail::set_placements(model, q, ws);
  detail::set_velocity(model, qd, ws);
  detail::filter_forces(model, ws, detail::BiasedForces<T, S>{model, tau, ws, acting});
  detail::smooth(model, ws, a);
}

// The same with joint noise r (nv) in every lane: of joints that have some in the model, and not less
// than there; of the others it is not looked at. ws.trace is T of the lane.
template <class T, class S>
void covariance_acceleration(const LoweredModel<S>& model, const T* q, const T* qd, const T* tau,
                             const T* r, CovarianceWorkspace<T>& ws, T* a,
                             const Acting<T>& acting = {}) {
  detail::set_placements(model, q, ws);
  detail::set_velocity(model, qd, ws);
  detail::filter_forces(model, ws, detail::NoisyForces<T, S>{{model, tau, ws, acting}, r});
  detail::smooth(model, ws, a);
  using std::max;
  if (!ws.forces) ws.size = ws.trace = T(S(0));
  for (int k = 0; k < model.nv(); ++k) {
    ws.rounding += (r[k] - T(model.body(k).r)) * (a[k] * a[k]);
    if (ws.forces) continue;
    const T mu = max(T(model.least_inertias()[k]), r[k]);
    ws.size += mu * (a[k] * a[k]);
    ws.trace += T(S(1)) / mu;
  }
}

}  // namespace kalmarm
