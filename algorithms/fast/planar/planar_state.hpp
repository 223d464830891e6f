// Positions and velocities of the links of a planar mechanism, in world axes, computed for all
// links before the filter runs (planar_filter.hpp), four links per SIMD register.
//
//   theta, w = sums of q - ref and q' from the base on
//   t, b     at home, turned by theta of the parent and of the link     (planar_model.hpp)
//   c = -w^2 p, w of the parent; of a slide + 2 w q' v                  v across its axis u
//   f = -w^2 h                                                          bias of the link alone
// Accelerations are those of material points at the links' origins, so that no other velocity term
// is left. Where a |theta| is above 64, all is worked out once more from angles without their whole
// turns: the sums of an arm that is wound up would lose digits of theta.
#pragma once

#include <vector>

#include "algorithms/fast/covariance/rounding_test.hpp"
#include "algorithms/fast/planar/planar_model.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/sincos.hpp"

namespace kalmarm {

// Moment about n and force, or angular and linear motion.
template <class T>
struct Planar {
  T n, x, y;
};

template <class T>
struct PlanarInertia {
  T J, x, y, xx, xy, yy;
};

template <class T>
KALMARM_INLINE void add(Planar<T>& to, const Planar<T>& from) {
  to.n += from.n;
  to.x += from.x;
  to.y += from.y;
}

template <class T>
KALMARM_INLINE void add(PlanarInertia<T>& to, const PlanarInertia<T>& from) {
  to.J += from.J;
  to.x += from.x;
  to.y += from.y;
  to.xx += from.xx;
  to.xy += from.xy;
  to.yy += from.yy;
}

// Number by number: gcc keeps in memory what is assigned as a whole.
template <class T>
KALMARM_INLINE void assign(Planar<T>& to, const Planar<T>& from) {
  to.n = from.n;
  to.x = from.x;
  to.y = from.y;
}

// t across a joint, its products for J, and c.
template <class T>
struct PlanarStep {
  T tx, ty, tt_xx, tt_xy, tt_yy;  // t t', twice off the diagonal
  T cx, cy;
};

// M and f of a link's own body.
template <class T>
struct PlanarBody {
  T J, x, y, m, fx, fy;
};

template <class T>
struct PlanarWorkspace {
  // Of a link as it stands: t and c of the hinge that hangs on it and is the next link, b, f,
  // theta.
  enum Row {
    next_tx,
    next_ty,
    next_tt_xx,
    next_tt_xy,
    next_tt_yy,
    next_cx,
    next_cy,
    body_x,
    body_y,
    bias_x,
    bias_y,
    theta,
    w,
    sine,
    cosine,
    rows
  };

  struct Link {
    T e;  // e+
    T D, inverse_D;
    Planar<T> g;  // of a slide along n, u and v; of 1 where r = 0 nothing
  };
  // Of a slide, or of a link that does not hang on the one before.
  struct Apart {
    PlanarStep<T> step;
    T ux, uy, reach;
  };
  // Of a link with children that are not the next link: the sum over them, and l-.
  struct Branch {
    PlanarInertia<T> P;
    HandedOn<T> pending;
    Planar<T> z, l;
  };

  JointTable<T, rows, Four<T>> table;
  std::vector<Link> links;
  std::vector<Apart> apart;
  std::vector<Branch> branches;
  std::vector<Planar<T>> z;  // z-
  T margin;                  // of D (covariance/rounding_test.hpp)
  T energy;                  // E of covariance/force_noise.hpp
  T squares;                 // |a|^2; not finite where an acceleration is not

  explicit PlanarWorkspace(const PlanarModel<T>& model)
      : table(model.nv()),
        links(model.nv()),
        apart(model.apart().size()),
        branches(model.branch_count()),
        z(model.nv()) {}

  // The rows of link k: row r is at [r * four<T>].
  const T* at(unsigned k) const {
    constexpr unsigned n = four<T>;
    return table.row(0, 0) + (k / n * (rows * n) + k % n);
  }

  template <bool forces>
  KALMARM_INLINE PlanarBody<T> body(const PlanarLink<T>& link, int k) const {
    constexpr int n = four<T>;
    const T* const from = at(k);
    return {link.J,
            from[body_x * n],
            from[body_y * n],
            link.m,
            forces ? from[bias_x * n] : T(0),
            forces ? from[bias_y * n] : T(0)};
  }

  KALMARM_INLINE PlanarStep<T> step(const PlanarLink<T>& link, int k) const {
    if (link.apart >= 0) return apart[link.apart].step;
    constexpr int n = four<T>;
    const T* const from = at(k - 1);
    return {from[next_tx * n],    from[next_ty * n], from[next_tt_xx * n], from[next_tt_xy * n],
            from[next_tt_yy * n], from[next_cx * n], from[next_cy * n]};
  }
};

namespace detail {

// x + offset less whole turns: by the products of sincos.hpp, which are exact, or from afar.
[[gnu::cold]] KALMARM_NOINLINE inline double without_turns(double x, double offset) {
  using K = SinCosConstants<double>;
  const double angle = x + offset, t = angle - x;
  if (std::abs(angle) <= K::farthest) {
    const double rounding = (x - (angle - t)) + (offset - t);
    const double turns = (angle * 0.15915494309189533577 + K::round) - K::round;
    const double n = 4 * turns;
    return (((angle - n * K::P1) - n * K::P2) - n * K::P3) + rounding;
  }
  const ReducedAngle at = reduced({x, offset});
  const int quarters = ((at.quarters + 1) & 3) - 1;  // -1 to 2
  return at.r.hi + (at.r.lo + quarters * half_pi.hi);
}

template <class T>
KALMARM_INLINE void sin_cos_of(const Four<T>& x, Four<T>& s, Four<T>& c) {
  using std::cos;
  using std::sin;
  if constexpr (four < T >> 1) {
    sin_cos(x, s, c);
  } else {
    s = sin(x);
    c = cos(x);
  }
}

// Running sums of q or q' from the base, where link k is DoF k and its parent is link k - 1.
template <class T>
struct SumAlongChain {
  Four<T> last = T(0);

  // The next block of `count`.
  KALMARM_INLINE Four<T> next(const Four<T>& x) {
    if constexpr (four < T >> 1) {
      const Four<T> sum = last + running_sum(x);
      last = sum[four<T> - 1];
      return sum;
    } else {
      return last = last + x;
    }
  }
};

// theta, and w where there is a velocity, of a tree.
template <bool moving, class T>
void set_sums(const PlanarModel<T>& model, const T* q, const T* qd, PlanarWorkspace<T>& ws) {
  using Ws = PlanarWorkspace<T>;
  T theta = T(0), w = T(0);
  for (int k = 0; k < model.nv(); ++k) {
    const PlanarLink<T>& link = model.link(k);
    if (!link.hangs_on_previous) {
      theta = link.parent < 0 ? T(0) : ws.table.at(Ws::theta, link.parent);
      if constexpr (moving) w = link.parent < 0 ? T(0) : ws.table.at(Ws::w, link.parent);
    }
    if (!link.slides) {
      theta += link.sign * (q[link.q_index] - link.ref);
      if constexpr (moving) w += link.sign * qd[link.dof];
    }
    ws.table.at(Ws::theta, k) = theta;
    if constexpr (moving) ws.table.at(Ws::w, k) = w;
  }
}

// Of the links of block i: t, b and, where there is a velocity, c and f.
template <bool moving, class T>
KALMARM_INLINE void set_block(const PlanarModel<T>& model, int i, const Four<T>& theta,
                              const Four<T>& w, PlanarWorkspace<T>& ws) {
  using Ws = PlanarWorkspace<T>;
  using At = PlanarModel<T>;
  Four<T> s, c;
  sin_cos_of<T>(theta, s, c);
  ws.table.store(Ws::sine, i, s);
  ws.table.store(Ws::cosine, i, c);
  const Four<T> ww = w * w;
  const auto turn = [&](int home, int to, int curved) {
    const Four<T> x = model.home().load(home, i), y = model.home().load(home + 1, i);
    const Four<T> new_x = c * x - s * y, new_y = s * x + c * y;
    ws.table.store(to, i, new_x);
    ws.table.store(to + 1, i, new_y);
    if constexpr (moving) {
      ws.table.store(curved, i, -(ww * new_y));
      ws.table.store(curved + 1, i, ww * new_x);
    }
  };
  turn(At::next_tx, Ws::next_tx, Ws::next_cx);
  turn(At::body_x, Ws::body_x, Ws::bias_x);
  const Four<T> tx = ws.table.load(Ws::next_tx, i), ty = ws.table.load(Ws::next_ty, i);
  ws.table.store(Ws::next_tt_xx, i, tx * tx);
  ws.table.store(Ws::next_tt_xy, i, (tx + tx) * ty);
  ws.table.store(Ws::next_tt_yy, i, ty * ty);
}

// The largest |theta| that is a sum of angles as they stand: it costs six bits.
template <class T>
inline constexpr T most_theta = T(64);

template <class T>
KALMARM_INLINE void see_turns(const Four<T>& theta, Four<T>& largest) {
  if constexpr (four < T >> 1) largest = max(largest, theta * theta);
}

// The same as below, of links that are wound up, with every theta less its whole turns.
template <bool moving, class T>
[[gnu::cold]] KALMARM_NOINLINE void set_unwound(const PlanarModel<T>& model, const T* q,
                                                PlanarWorkspace<T>& ws) {
  using Ws = PlanarWorkspace<T>;
  for (int k = 0; k < model.nv(); ++k) {
    const PlanarLink<T>& link = model.link(k);
    double theta = link.parent < 0 ? 0.0 : double(ws.table.at(Ws::theta, link.parent));
    if (!link.slides) theta += link.sign * without_turns(q[link.q_index], -link.ref);
    ws.table.at(Ws::theta, k) = T(without_turns(theta, 0));
  }
  for (int i = 0; i < ws.table.blocks(); ++i)
    set_block<moving>(model, i, ws.table.load(Ws::theta, i), ws.table.load(Ws::w, i), ws);
}

// Where the links are and how they turn: t, b, c and f of every link.
template <bool moving, class T>
void set_state(const PlanarModel<T>& model, const T* q, const T* qd, PlanarWorkspace<T>& ws) {
  using At = PlanarModel<T>;
  using Ws = PlanarWorkspace<T>;
  constexpr int lanes = four<T>;
  Four<T> largest = T(0);  // theta^2
  if (model.is_chain()) {
    SumAlongChain<T> thetas, ws_of_links;
    for (int i = 0; i < ws.table.blocks(); ++i) {
      const int first = i * lanes, count = model.nv() - first;
      const Four<T> sign = model.home().load(At::sign, i), ref = model.home().load(At::ref, i);
      const Four<T> theta = thetas.next(sign * (load_first<Four<T>>(q + first, count) - ref));
      see_turns<T>(theta, largest);
      Four<T> w = T(0);
      if constexpr (moving) {
        w = ws_of_links.next(sign * load_first<Four<T>>(qd + first, count));
        ws.table.store(Ws::w, i, w);
      }
      set_block<moving>(model, i, theta, w, ws);
    }
  } else {
    set_sums<moving>(model, q, qd, ws);
    for (int i = 0; i < ws.table.blocks(); ++i) {
      const Four<T> theta = ws.table.load(Ws::theta, i);
      see_turns<T>(theta, largest);
      set_block<moving>(model, i, theta, ws.table.load(Ws::w, i), ws);
    }
  }
  if constexpr (lanes > 1)
    if (any_above(largest, most_theta<T> * most_theta<T>)) set_unwound<moving>(model, q, ws);
  for (const int k : model.apart()) {
    const PlanarLink<T>& link = model.link(k);
    auto& apart = ws.apart[link.apart];
    T s = T(0), c = T(1), w = T(0);
    if (link.parent >= 0) {
      s = ws.table.at(Ws::sine, link.parent);
      c = ws.table.at(Ws::cosine, link.parent);
      if constexpr (moving) w = ws.table.at(Ws::w, link.parent);
    }
    T tx = c * link.tx - s * link.ty, ty = s * link.tx + c * link.ty;
    apart.reach = link.reach;
    if (link.slides) {
      const T d = q[link.q_index] - link.ref;
      apart.ux = c * link.ux - s * link.uy;
      apart.uy = s * link.ux + c * link.uy;
      apart.reach += T(4) * d * d;
      tx -= d * apart.uy;
      ty += d * apart.ux;
    }
    apart.step.tx = tx;
    apart.step.ty = ty;
    apart.step.tt_xx = tx * tx;
    apart.step.tt_xy = T(2) * tx * ty;
    apart.step.tt_yy = ty * ty;
    if constexpr (moving) {
      const T ww = w * w;
      apart.step.cx = -(ww * ty);
      apart.step.cy = ww * tx;
      if (link.slides) {
        const T twice = T(2) * w * qd[link.dof];
        apart.step.cx -= twice * apart.uy;
        apart.step.cy += twice * apart.ux;
      }
    }
  }
}

}  // namespace detail

}  // namespace kalmarm
