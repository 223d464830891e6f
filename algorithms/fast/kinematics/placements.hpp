// Where the links of the fast path stand, from q: sines and cosines of hinges, matrices of free joints; and
// forces and motions from link to link there.
#pragma once

#include <vector>

#include "algorithms/fast/kinematics/moves.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/sincos.hpp"

namespace kalmarm {

// The part of phi that depends on q. d of slides is stored with the link.
template <class T>
struct Placements {
  std::vector<T> q, sin, cos;  // of the hinges
  std::vector<MatrixPlacement<T>> matrices;

  template <class S>
  explicit Placements(const LoweredModel<S>& model)
      : q((model.angles() + padding<T> - 1) / padding<T> * padding<T>, T(S(0))),
        sin(q),
        cos(q),
        matrices(model.matrices()) {}

  template <class S>
  Direction<T> direction(const LoweredLink<S>& link) const {
    return {cos[link.varying], sin[link.varying]};
  }
};

namespace detail {

// cos and sin of every hinge's angle.
template <class T, class S, class Placed>
void set_angles(const LoweredModel<S>& model, const T* q, Placed& placed) {
  const HingeAngles<S>& hinges = model.hinges();
  for (int i = 0; i < model.angles(); ++i) placed.q[i] = q[hinges.q_index[i]];
  sin_cos(placed.q, hinges.offset, hinges.quarters, placed.sin, placed.cos);
}

// Where the links are.
template <class T, class S, class Workspace>
void set_placements(const LoweredModel<S>& model, const T* q, Workspace& ws) {
  using Kind = typename LoweredLink<S>::Kind;
  set_angles(model, q, ws);
  for (int k = 0; k < model.nv(); ++k) {
    const LoweredLink<S>& link = model.link(k);
    const T* const at = q + link.q_index;
    if (link.kind == Kind::screws && link.slides)
      ws.links[k].d = *at + T(link.d);
    else if (link.kind == Kind::matrix)
      set_matrix(link, model.uncommon(link).E, at, ws.matrices[link.varying]);
  }
}

// phi z+, for several columns at once.
template <class T, class S, class U>
KALMARM_INLINE void force_to_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                    const Placements<U>& placed, const U& d, Sixfold<T>& z) {
  using Kind = typename LoweredLink<S>::Kind;
  switch (link.kind) {
    case Kind::screws:
      if (link.slides)
        force_to_parent(model, link, model.uncommon(link).turn, d, z);
      else
        force_to_parent(model, link, placed.direction(link), link.d, z);
      break;
    case Kind::matrix:
      force_to_parent(placed.matrices[link.varying], z);
      break;
    case Kind::cyclic:
      cycle(z.x, z.y, z.z);
      cycle(z.u, z.v, z.w);
      break;
  }
}

// phi' l- of the parent, for one of T or, with U a number and T a Pack, for several; `moved` as in moves.hpp.
template <bool moved = true, class T, class S, class U>
KALMARM_INLINE void motion_from_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                       const Placements<U>& placed, const U& d, Sixfold<T>& l) {
  using Kind = typename LoweredLink<S>::Kind;
  switch (link.kind) {
    case Kind::screws:
      if (link.slides)
        motion_from_parent<moved>(model, link, model.uncommon(link).turn, d, l);
      else
        motion_from_parent<moved>(model, link, placed.direction(link), link.d, l);
      break;
    case Kind::matrix:
      motion_from_parent<moved>(placed.matrices[link.varying], l);
      break;
    case Kind::cyclic:
      cycle_back(l.x, l.y, l.z);
      cycle_back(l.u, l.v, l.w);
      break;
  }
}

}  // namespace detail

}  // namespace kalmarm
