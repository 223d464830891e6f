// Where links stand and how they move, in the axes of the fixed base, base to tips, for one state or, with
// T a Pack, one state in every lane. With the placement of lowered_link.hpp, r = p(k) - p(parent), e the
// joint's axis and u the angular velocity w before the joint, whose axes at a ball are all its body's:
//   R(k) = R(parent) Rz(theta) Rx(alpha) Rz(angle),  e = R(k) e_z                             (1)
//   r    = R(parent) p + d e                                                                  (2)
//   v(k) = v(parent) + w x r                                        + e q' at a slide         (3)
//   w(k) = w(parent) + e q' at a hinge                                                        (4)
//   a(k) = a(parent) + w' x r + w x (w x r)                         + 2 u x e q' + e q'' at a slide  (5)
//   w'(k) = w'(parent) + u x e q' + e q'' at a hinge                                          (6)
// w and w' of (3) and (5) are the parent's: where a joint turns, r ends on its axis. v and a are those of
// the link's origin, without gravity.
//
// p(k) is kept from the root of link k's tree, where a position joint on the base ends, else the placement
// on the base: what is near each other keeps its digits wherever the robot has gone. About 60 flops a hinge,
// 105 with velocities, and its sine and cosine.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "algorithms/fast/kinematics/placements.hpp"
#include "algorithms/fast/kinematics/triple.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

namespace detail {

template <class T>
Triple<T> zeros() {
  const T zero = T(typename Lanes<T>::Scalar(0));
  return {zero, zero, zero};
}

}  // namespace detail

// Links in rising order that begin at the base, and their hinges, whose sines and cosines are worked out together.
template <class T>
class Way {
  using S = typename Lanes<T>::Scalar;

 public:
  std::vector<int> links;
  std::vector<int> hinge;  // of each, if it is one: its place in sin and cos
  std::vector<T> sin, cos;

  Way(const LoweredModel<S>& model, std::vector<int> on_it) : links(std::move(on_it)) {
    const HingeAngles<S>& all = model.hinges();
    for (const int k : links) {
      const LoweredLink<S>& link = model.link(k);
      hinge.push_back(static_cast<int>(angles_.q_index.size()));
      if (link.coordinate != Coordinate::angle) continue;
      const auto i = angles_.q_index.size();
      if (i % padding<S> == 0) {
        angles_.offset.resize(i + padding<S>, S(0));
        angles_.quarters.resize(i + padding<S>);
      }
      angles_.q_index.push_back(all.q_index[link.varying]);
      angles_.offset[i] = all.offset[link.varying];
      angles_.quarters[i] = all.quarters[link.varying];
    }
    q_.resize((angles_.q_index.size() + padding<T> - 1) / padding<T> * padding<T>, T(S(0)));
    sin = cos = q_;
  }

  void set_angles(const T* q) {
    for (std::size_t i = 0; i < angles_.q_index.size(); ++i) q_[i] = q[angles_.q_index[i]];
    sin_cos(q_, angles_.offset, angles_.quarters, sin, cos);
  }

 private:
  HingeAngles<S> angles_;
  std::vector<T> q_;
};

template <class T>
class WorldMotion {
  using S = typename Lanes<T>::Scalar;

 public:
  struct Link {
    int tree;    // of `roots`
    Triad<T> R;  // (1)
    Triple<T> p, w, v, w_dot, a;
  };

  std::vector<Link> links;
  std::vector<Triple<T>> roots;  // of every tree, in the base's axes; zero where there is none

  explicit WorldMotion(const LoweredModel<S>& model) : links(model.nv()) {
    for (int k = 0; k < model.nv(); ++k) {
      const int parent = model.link(k).parent;
      links[k].tree = parent < 0 ? static_cast<int>(bases_.size()) : links[parent].tree;
      if (parent >= 0) continue;
      const Matrix3<S>& E = model.uncommon(model.link(k)).E0;
      const Vector3<S>& d = model.uncommon(model.link(k)).d0;
      const auto column = [&](int j) { return Triple<T>{T(E(0, j)), T(E(1, j)), T(E(2, j))}; };
      bases_.push_back({{column(0), column(1), column(2)}, {T(d[0]), T(d[1]), T(d[2])}});
    }
    roots.assign(std::max<std::size_t>(bases_.size(), 1), detail::zeros<T>());
  }

  // R and p of the links on the way.
  void stand(const LoweredModel<S>& model, Way<T>& way, const T* q) {
    sweep<false>(model, way, q, nullptr, nullptr);
  }
  // The same, and how they move; qdd: null where it is zero.
  void move(const LoweredModel<S>& model, Way<T>& way, const T* q, const T* qd, const T* qdd) {
    sweep<true>(model, way, q, qd, qdd);
  }

 private:
  // The base's frame of a tree, by the placement of its first link.
  struct Base {
    Triad<T> R;
    Triple<T> p;
  };

  template <bool moves>
  void sweep(const LoweredModel<S>& model, Way<T>& way, const T* q, const T* qd, const T* qdd);

  std::vector<Base> bases_;
};

namespace detail {

// (x, y) of axes turned about the third by (c, s).
template <class T, class C>
KALMARM_INLINE void turn_axes(const Direction<C>& by, Triple<T>& x, Triple<T>& y) {
  const Triple<T> turned = by.c * x + by.s * y;
  y = by.c * y - by.s * x;
  x = turned;
}

// (1) and (2): R becomes that of the link, whose joint is at q and, if it is a hinge, turned by `hinge`; r.
template <class T, class S>
KALMARM_INLINE Triple<T> place(const LoweredModel<S>& model, const LoweredLink<S>& link, const T* q,
                               const Direction<T>& hinge, Triad<T>& R) {
  using Kind = typename LoweredLink<S>::Kind;
  using Tilt = typename LoweredLink<S>::Tilt;
  if (link.kind == Kind::cyclic) {
    R = {R.y, R.z, R.x};
    return zeros<T>();
  }
  if (link.kind == Kind::matrix) {
    MatrixPlacement<T> phi;
    set_matrix(link, model.uncommon(link).E, q, phi);
    const auto column = [&](int j) {
      return R.turned(phi.R.R[0][j], phi.R.R[1][j], phi.R.R[2][j]);
    };
    const Triple<T> r = R.turned(phi.p[0], phi.p[1], phi.p[2]);
    R = {column(0), column(1), column(2)};
    return r;
  }
  Triple<T> r = link.p[0] * R.x;
  if (link.p[1] != S(0)) r += link.p[1] * R.y;
  if (link.p[2] != S(0)) r += link.p[2] * R.z;
  if (link.turned) turn_axes(model.uncommon(link).theta, R.x, R.y);
  if (link.tilt == Tilt::right) {
    const Triple<T> y = R.y;
    R.y = R.z;
    R.z = {-y.x, -y.y, -y.z};
  } else if (link.tilt == Tilt::any) {
    turn_axes(link.alpha, R.y, R.z);
  }
  if (link.slides) {
    turn_axes(model.uncommon(link).turn, R.x, R.y);
    return r + T(*q + T(link.d)) * R.z;
  }
  turn_axes(hinge, R.x, R.y);
  return link.d != S(0) ? r + link.d * R.z : r;
}

}  // namespace detail

template <class T>
template <bool moves>
void WorldMotion<T>::sweep(const LoweredModel<S>& model, Way<T>& way, const T* q, const T* qd,
                           const T* qdd) {
  using Kind = typename LoweredLink<S>::Kind;
  way.set_angles(q);
  const Triple<T> zero = detail::zeros<T>();
  // Of the link before, in registers.
  Triad<T> R;
  Triple<T> p, w, v, w_dot, a, u;
  for (std::size_t i = 0; i < way.links.size(); ++i) {
    const int k = way.links[i];
    const LoweredLink<S>& link = model.link(k);
    Link& at = links[k];
    if (link.parent < 0) {
      R = bases_[at.tree].R;
      p = zero;
      if constexpr (moves) w = v = w_dot = a = zero;
    } else if (!link.hangs_on_previous) {
      const Link& parent = links[link.parent];
      R = parent.R;
      p = parent.p;
      if constexpr (moves) {
        w = parent.w;
        v = parent.v;
        w_dot = parent.w_dot;
        a = parent.a;
      }
    }
    const bool turns = link.coordinate == Coordinate::angle;
    const Direction<T> hinge = turns ? Direction<T>{way.cos[way.hinge[i]], way.sin[way.hinge[i]]}
                                     : Direction<T>{zero.x, zero.x};
    Triple<T> r = detail::place(model, link, q + link.q_index, hinge, R);
    if (link.parent < 0) {
      roots[at.tree] = bases_[at.tree].p;
      if (link.coordinate == Coordinate::position) {
        roots[at.tree] += r;
        r = zero;
      }
    }
    p += r;
    at.R = R;
    at.p = p;
    if constexpr (moves) {
      if (link.kind != Kind::cyclic) u = w;
      const Triple<T>& e = R.z;
      const Triple<T> w_x_r = cross(w, r), u_x_e = qd[k] * cross(u, e);
      v += w_x_r;
      a += cross(w_dot, r) + cross(w, w_x_r);
      if (link.slides) {
        v += qd[k] * e;
        a += u_x_e + u_x_e;
        if (qdd) a += qdd[k] * e;
      } else {
        w += qd[k] * e;
        w_dot += u_x_e;
        if (qdd) w_dot += qdd[k] * e;
      }
      at.w = w;
      at.v = v;
      at.w_dot = w_dot;
      at.a = a;
    }
  }
}

}  // namespace kalmarm
