// Forces from outside that act on links, for one state or, with T a Pack, one state in every lane.
//
// Of a frame with the pose (A, s) in its link's axes a force (n; f), n about its origin, is in these axes and
// about the link's origin
//   (A n + s x A f; A f)                                                                    (1)
// A force that is given in the base's axes is turned along the links of its way first,
//   n(k) = R(k)'n(parent),  f(k) = R(k)'f(parent)                                           (2)
// and one about the base's origin is moved as well: n(k) = R'(n + f x p)(parent). That is what phi' does to a
// motion whose angular half is f and whose linear half is n. What arrives is about the link's origin: of a force
// about the frame's own, (1) has still to add s x f.
//
// z- of a link is the force on it that its own motion does not account for: its sum over children begins at minus
// what acts on it. (1) takes 50 flops a frame, (2) about 24 a link of its way, moved 34.
#pragma once

#include <vector>

#include "algorithms/fast/kinematics/placements.hpp"
#include "algorithms/fast/kinematics/triple.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "kalmarm/call.hpp"

namespace kalmarm {

// What a call gives of frames. Of all of LoweredModel::acted_on, or of its contacts, six numbers each: (moment; force)
// in these axes; of those that are loaded ten (loads.hpp). Null: none. Gravity: three numbers in the base's axes
// [m/s^2]; null: the model's.
template <class T>
struct Acting {
  const T* forces = nullptr;
  Axes axes = Axes::local;
  const T* loads = nullptr;
  const T* gravity = nullptr;
};

template <class T>
Acting<T> forces_of(const Call<T>& call) {
  return {call.forces, call.axes, call.loads, call.gravity};
}
template <class T>
Acting<T> contacts_of(const Call<T>& call) {
  return {call.contacts, call.axes, call.loads};
}

namespace detail {

template <class T>
Triple<T> three(const T* x) {
  return {x[0], x[1], x[2]};
}

// Acceleration of a child of the base before its joint, -E'gravity of its placement's E; gravity: as Acting has it.
template <class T, class S>
Triple<T> base_acceleration(const UncommonPlacement<S>& base, const T* gravity) {
  if (!gravity) return {T(base.a0[0]), T(base.a0[1]), T(base.a0[2])};
  const auto row = [&](int i) {
    T sum = (T(base.E0(0, i)) * gravity[0] + T(base.E0(1, i)) * gravity[1]) +
            T(base.E0(2, i)) * gravity[2];
    normalise(sum);
    return -sum;
  };
  return {row(0), row(1), row(2)};
}

// What acts on a link, in its axes and about its origin, and the sums of |n|^2 and |f|^2 over all places where
// these were rounded.
template <class T>
struct OnLink {
  Triple<T> n, f;
  T moments, forces;
};

// (2) of a force in the base's axes.
template <bool moved, class T, class S, class Workspace>
OnLink<T> along_way(const LoweredModel<S>& model, const LoweredFrame<S>& frame, const Workspace& ws,
                    const T* force) {
  const auto& base = model.uncommon(model.link(frame.way[0]));
  const auto back = [&](const Triple<T>& v) {
    const auto row = [&](int i) {
      return T(base.E0(0, i)) * v.x + T(base.E0(1, i)) * v.y + T(base.E0(2, i)) * v.z;
    };
    return Triple<T>{row(0), row(1), row(2)};
  };
  Triple<T> n = three(force), f = three(force + 3);
  T moments = dot(n, n), forces = dot(f, f);
  if constexpr (moved) n += cross(f, Triple<T>{T(base.d0[0]), T(base.d0[1]), T(base.d0[2])});
  n = back(n);
  f = back(f);
  Sixfold<T> l = {f.x, f.y, f.z, n.x, n.y, n.z};
  for (const int k : frame.way) {
    normalise(l.x, l.y, l.z);
    normalise(l.u, l.v, l.w);
    motion_from_parent<moved>(model, model.link(k), ws, ws.links[k].d, l);
    forces += l.x * l.x + l.y * l.y + l.z * l.z;
    moments += l.u * l.u + l.v * l.v + l.w * l.w;
  }
  return {{l.u, l.v, l.w}, {l.x, l.y, l.z}, moments, forces};
}

// s x f is added to n.
template <class T, class S>
OnLink<T> about_link(const LoweredFrame<S>& frame, const OnLink<T>& at) {
  const Triple<T> s = {T(frame.s[0]), T(frame.s[1]), T(frame.s[2])};
  return {at.n + cross(s, at.f), at.f, at.moments + dot(s, s) * dot(at.f, at.f), at.forces};
}

// (1) of a force in the frame's own axes.
template <class T, class S>
OnLink<T> from_own_axes(const LoweredFrame<S>& frame, const T* force) {
  const auto turned = [&frame](const T* v) {
    const auto row = [&](int i) {
      return T(frame.A(i, 0)) * v[0] + T(frame.A(i, 1)) * v[1] + T(frame.A(i, 2)) * v[2];
    };
    return Triple<T>{row(0), row(1), row(2)};
  };
  const Triple<T> n = turned(force), f = turned(force + 3);
  return about_link(frame, OnLink<T>{n, f, dot(n, n), dot(f, f)});
}

template <class T>
void subtract(Sixfold<T>& z, const OnLink<T>& on) {
  add(z, Sixfold<T>{-on.n.x, -on.n.y, -on.n.z, -on.f.x, -on.f.y, -on.f.z});
}

// What a force in these axes does to a frame's link; ws: as motion_from_parent takes it.
template <class T, class S, class Workspace>
KALMARM_NOINLINE OnLink<T> acting_on_link(const LoweredModel<S>& model, const Workspace& ws,
                                          Axes axes, const LoweredFrame<S>& frame, const T* force) {
  switch (axes) {
    case Axes::local:
      break;
    case Axes::aligned:
      return about_link(frame, along_way<false>(model, frame, ws, force));
    case Axes::world:
      return along_way<true>(model, frame, ws, force);
  }
  return from_own_axes(frame, force);
}

// The sums over children begin. seen(link, what acts on it) of every frame.
template <class T, class S, class Workspace, class Seen>
void begin_sums(const LoweredModel<S>& model, Workspace& ws, const Acting<T>& acting,
                const Seen& seen) {
  for (auto& branch : ws.branches) set_zero(branch.z);
  if (!acting.forces) return;
  for (std::size_t i = 0; i < model.acted_on().size(); ++i) {
    const LoweredFrame<S>& frame = model.acted_on()[i];
    const OnLink<T> on = acting_on_link(model, ws, acting.axes, frame, acting.forces + 6 * i);
    subtract(ws.branches[model.link(frame.link).branch].z, on);
    seen(frame.link, on);
  }
}

}  // namespace detail

}  // namespace kalmarm
