// Forces from outside that act on links, for one state or, with T a Pack, one state in every lane.
//
// Of a frame with the pose (A, s) in its link's axes a force (n; f), n about its origin, is in these axes and
// about the link's origin
//   (A n + s x A f; A f)                                                                    (1)
// Given in the base's axes it is first turned along the links of its way,
//   f(k) = R(k)'f(parent)                                                                   (2)
// and about the base's origin moved too, n(k) = R'(n + f x p)(parent), which is what phi' does to the motion
// (f; n) with f for the angular half. Then (R n + s x f; f) without A, or, since it is about the link's origin
// already, itself.
//
// z- is the force on a link that is not balanced by its motion: a link's sum over its children begins at minus
// what acts on it. (1) takes 39 flops a frame, (2) about 24 a link of its way.
#pragma once

#include <vector>

#include "algorithms/fast/kinematics/placements.hpp"
#include "algorithms/fast/kinematics/triple.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// Of all frames of LoweredModel::acted_on, six numbers each: (moment; force) in these axes. Null: none acts.
template <class T>
struct Acting {
  const T* forces = nullptr;
  Axes axes = Axes::local;
};

namespace detail {

template <class T>
Triple<T> three(const T* x) {
  return {x[0], x[1], x[2]};
}

// (2), with what phi' does to the second half.
template <class T, class S, class Workspace>
Sixfold<T> along_way(const LoweredModel<S>& model, const LoweredFrame<S>& frame,
                     const Workspace& ws, const Triple<T>& first, const Triple<T>& second) {
  const auto& base = model.uncommon(model.link(frame.way[0]));
  const auto back = [&](const Triple<T>& v) {
    const auto row = [&](int i) {
      return T(base.E0(0, i)) * v.x + T(base.E0(1, i)) * v.y + T(base.E0(2, i)) * v.z;
    };
    return Triple<T>{row(0), row(1), row(2)};
  };
  const Triple<T> d0 = {T(base.d0[0]), T(base.d0[1]), T(base.d0[2])};
  const Triple<T> angular = back(first), linear = back(second + cross(first, d0));
  Sixfold<T> l = {angular.x, angular.y, angular.z, linear.x, linear.y, linear.z};
  for (const int k : frame.way) {
    normalise(l.x, l.y, l.z);
    normalise(l.u, l.v, l.w);
    motion_from_parent(model, model.link(k), ws, ws.links[k].d, l);
  }
  return l;
}

// (1).
template <class T, class S>
Sixfold<T> on_link(const LoweredFrame<S>& frame, const Triple<T>& moment, const Triple<T>& force) {
  const Triple<T> s = {T(frame.s[0]), T(frame.s[1]), T(frame.s[2])};
  const Triple<T> n = moment + cross(s, force);
  return {n.x, n.y, n.z, force.x, force.y, force.z};
}

// (1) of a force in the frame's own axes.
template <class T, class S>
Sixfold<T> from_own_axes(const LoweredFrame<S>& frame, const T* force) {
  const auto turned = [&frame](const T* v) {
    const auto row = [&](int i) {
      return T(frame.A(i, 0)) * v[0] + T(frame.A(i, 1)) * v[1] + T(frame.A(i, 2)) * v[2];
    };
    return Triple<T>{row(0), row(1), row(2)};
  };
  return on_link(frame, turned(force), turned(force + 3));
}

// What acts at frame i, in its link's axes and about the link's origin; ws: as motion_from_parent takes it.
template <class T, class S, class Workspace>
KALMARM_NOINLINE Sixfold<T> acting_on_link(const LoweredModel<S>& model, const Workspace& ws,
                                           const Acting<T>& acting, std::size_t i) {
  const LoweredFrame<S>& frame = model.acted_on()[i];
  const T* const force = acting.forces + 6 * i;
  const Triple<T> n = three(force), f = three(force + 3);
  const Triple<T> zero = {T(S(0)), T(S(0)), T(S(0))};
  switch (acting.axes) {
    case Axes::local:
      break;
    case Axes::aligned: {
      const Sixfold<T> moment = along_way(model, frame, ws, n, zero),
                       turned = along_way(model, frame, ws, f, zero);
      return on_link(frame, Triple<T>{moment.x, moment.y, moment.z},
                     Triple<T>{turned.x, turned.y, turned.z});
    }
    case Axes::world: {
      const Sixfold<T> l = along_way(model, frame, ws, f, n);
      return {l.u, l.v, l.w, l.x, l.y, l.z};
    }
  }
  return from_own_axes(frame, force);
}

// The sums over children begin. seen(frame, what acts on its link) of every frame.
template <class T, class S, class Workspace, class Seen>
void begin_sums(const LoweredModel<S>& model, Workspace& ws, const Acting<T>& acting,
                const Seen& seen) {
  for (auto& branch : ws.branches) set_zero(branch.z);
  if (!acting.forces) return;
  for (std::size_t i = 0; i < model.acted_on().size(); ++i) {
    const LoweredFrame<S>& frame = model.acted_on()[i];
    const Sixfold<T> f = acting_on_link(model, ws, acting, i);
    const Sixfold<T> minus = {-f.x, -f.y, -f.z, -f.u, -f.v, -f.w};
    add(ws.branches[model.link(frame.link).branch].z, minus);
    seen(frame, f);
  }
}

}  // namespace detail

}  // namespace kalmarm
