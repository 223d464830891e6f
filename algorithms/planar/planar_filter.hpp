// Filter and smoother of a planar mechanism in world axes: 3-vectors (moment about n; force), no
// rotation at all, P of six numbers, [J b'; b C].
//
//   theta, w = sums of (q - ref), q' from the base; their sines and cosines, many at once
//   c = -w^2 p, w of the parent; of a slide + 2 w q' v: acceleration that turning brings   t, p, b:
//   f = -w^2 h                                          bias of the link alone   planar_model.hpp
// Accelerations are those of material points at the links' origins, so that no other velocity term
// is left. Tips to base:
//   D = J + r,  g = (J; b) / D,  C+ = C - b b' / D      a hinge, H = (1; 0)    (3.6), (3.10)
//   P+ = [0 0; 0 C+]                                    where r = 0; else J+ = r J / D, b+ = r b /
//   D D = u'Cu + r, in the axes u and v of a slide, H = (0; u), v across u, in the same way e = tau
//   - H z-,  z+ = z- + g e + P+ c,  H z+ = tau where r = 0            (4.2), (4.5) b- += b+ + C+ t,
//   J- += J+ + t'(b+ + (b+ + C+ t))   phi P+ phi'           (3.6) z- += phi z+: the moment gains
//   t'z                                        (4.4)
// base to tips:
//   l+ = phi' l-(parent) + c: the linear part gains t alpha                   (4.10)
//   a = e / D - g'l+,  l- = l+ + H'a                                          (4.9), (4.11)
// Where r = 0 at a hinge, alpha = e / D - g'l+ of the linear part alone, and a is what it differs
// from the parent's. An angle is known to half a unit in the last place of theta, so an arm that is
// wound up loses a digit with ten turns.
#pragma once

#include <vector>

#include "algorithms/planar/planar_model.hpp"
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
[[gnu::always_inline]] inline void add(const Planar<T>& from, Planar<T>& to) {
  to.n += from.n;
  to.x += from.x;
  to.y += from.y;
}

template <class T>
[[gnu::always_inline]] inline void add(const PlanarInertia<T>& from, PlanarInertia<T>& to) {
  to.J += from.J;
  to.x += from.x;
  to.y += from.y;
  to.xx += from.xx;
  to.xy += from.xy;
  to.yy += from.yy;
}

// Number by number: gcc keeps in memory what is assigned as a whole.
template <class T>
[[gnu::always_inline]] inline void copy(const Planar<T>& from, Planar<T>& to) {
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

// M, f and the sizes that a link alone brings.
template <class T>
struct PlanarBody {
  T J, x, y, m, fx, fy, size_J, size_m;
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
  // Of a link with children that are not the next link: what they have summed up to, and l-.
  struct Branch {
    PlanarInertia<T> P;
    T size_J, size_m;
    Planar<T> z, l;
  };

  JointTable<T, rows, Four<T>> table;
  std::vector<Link> links;
  std::vector<Apart> apart;
  std::vector<Branch> branches;
  T margin;  // least D - net x size
  T check;   // zero where every acceleration was finite, else NaN

  explicit PlanarWorkspace(const PlanarModel<T>& model)
      : table(model.nv()),
        links(model.nv()),
        apart(model.apart().size()),
        branches(model.slots()) {}

  // The rows of link k: row r is at [r * four<T>].
  const T* at(unsigned k) const {
    constexpr unsigned n = four<T>;
    return table.row(0, 0) + (k / n * (rows * n) + k % n);
  }

  template <bool forces>
  [[gnu::always_inline]] PlanarBody<T> body(const PlanarLink<T>& link, int k) const {
    constexpr int n = four<T>;
    const T* const from = at(k);
    return {link.J,
            from[body_x * n],
            from[body_y * n],
            link.m,
            forces ? from[bias_x * n] : T(0),
            forces ? from[bias_y * n] : T(0),
            link.J + link.r,
            link.size_m};
  }

  [[gnu::always_inline]] PlanarStep<T> step(const PlanarLink<T>& link, int k) const {
    if (link.apart >= 0) return apart[link.apart].step;
    constexpr int n = four<T>;
    const T* const from = at(k - 1);
    return {from[next_tx * n],    from[next_ty * n], from[next_tt_xx * n], from[next_tt_xy * n],
            from[next_tt_yy * n], from[next_cx * n], from[next_cy * n]};
  }
};

namespace detail {

template <class T>
[[gnu::always_inline]] inline void sin_cos_of(const Four<T>& x, Four<T>& s, Four<T>& c) {
  using std::cos;
  using std::sin;
  if constexpr (four < T >> 1) {
    sin_cos(x, s, c);
  } else {
    s = sin(x);
    c = cos(x);
  }
}

// What q or q' adds up to from the base, where link k is DoF k and hangs on link k - 1.
template <class T>
struct SumAlongChain {
  Four<T> last = T(0);

  // The next block of `count`.
  [[gnu::always_inline]] Four<T> next(const Four<T>& x) {
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

// Of link 8 i and the next ones of a block: t, b and, where there is a velocity, c and f.
template <bool moving, class T>
[[gnu::always_inline]] inline void set_block(const PlanarModel<T>& model, int i,
                                             const Four<T>& theta, const Four<T>& w,
                                             PlanarWorkspace<T>& ws) {
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

// Where the links are and how they turn: t, b, c and f of every link.
template <bool moving, class T>
void set_state(const PlanarModel<T>& model, const T* q, const T* qd, PlanarWorkspace<T>& ws) {
  using At = PlanarModel<T>;
  using Ws = PlanarWorkspace<T>;
  constexpr int lanes = four<T>;
  if (model.is_chain()) {
    SumAlongChain<T> thetas, ws_of_links;
    for (int i = 0; i < ws.table.blocks(); ++i) {
      const int first = i * lanes, count = model.nv() - first;
      const Four<T> sign = model.home().load(At::sign, i), ref = model.home().load(At::ref, i);
      const Four<T> theta = thetas.next(sign * (load_first<Four<T>>(q + first, count) - ref));
      Four<T> w = T(0);
      if constexpr (moving) {
        w = ws_of_links.next(sign * load_first<Four<T>>(qd + first, count));
        ws.table.store(Ws::w, i, w);
      }
      set_block<moving>(model, i, theta, w, ws);
    }
  } else {
    set_sums<moving>(model, q, qd, ws);
    for (int i = 0; i < ws.table.blocks(); ++i)
      set_block<moving>(model, i, ws.table.load(Ws::theta, i), ws.table.load(Ws::w, i), ws);
  }
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

// Across a hinge: P- becomes P+; D, g are kept.
template <bool noise, class T>
[[gnu::always_inline]] inline void measure_turn(const T& r, PlanarInertia<T>& P,
                                                typename PlanarWorkspace<T>::Link& at) {
  const T D = noise ? T(P.J + r) : P.J, inverse_D = T(1) / D;
  // The products do not wait for the division.
  const T xx = P.x * P.x, xy = P.x * P.y, yy = P.y * P.y;
  at.D = D;
  at.inverse_D = inverse_D;
  at.g.x = P.x * inverse_D;
  at.g.y = P.y * inverse_D;
  P.xx = P.xx - xx * inverse_D;
  P.xy = P.xy - xy * inverse_D;
  P.yy = P.yy - yy * inverse_D;
  if constexpr (noise) {
    at.g.n = P.J * inverse_D;
    P.J = r * at.g.n;
    P.x = r * at.g.x;
    P.y = r * at.g.y;
  }
}

// Across a slide along u; v = (-u_y, u_x).
template <bool noise, class T>
[[gnu::always_inline]] inline void measure_slide(const T& r, const T& ux, const T& uy,
                                                 PlanarInertia<T>& P,
                                                 typename PlanarWorkspace<T>::Link& at) {
  const T sx = P.xx * ux + P.xy * uy, sy = P.xy * ux + P.yy * uy;
  const T uu = sx * ux + sy * uy, uv = sy * ux - sx * uy;
  const T vv = (P.xx * uy - P.xy * ux) * uy + (P.yy * ux - P.xy * uy) * ux;
  const T u = P.x * ux + P.y * uy, v = P.y * ux - P.x * uy;
  const T D = noise ? T(uu + r) : uu, inverse_D = T(1) / D;
  at.D = D;
  at.inverse_D = inverse_D;
  at.g.n = u * inverse_D;
  at.g.y = uv * inverse_D;
  P.J = P.J - at.g.n * u;
  const T v_plus = v - at.g.n * uv, vv_plus = vv - at.g.y * uv;
  P.x = -(v_plus * uy);
  P.y = v_plus * ux;
  P.xx = vv_plus * uy * uy;
  P.xy = -(vv_plus * ux * uy);
  P.yy = vv_plus * ux * ux;
  if constexpr (noise) {
    at.g.x = uu * inverse_D;
    const T u_plus = r * at.g.n, uu_plus = r * at.g.x, uv_plus = r * at.g.y;
    P.x += u_plus * ux;
    P.y += u_plus * uy;
    P.xx += ux * (uu_plus * ux - T(2) * uv_plus * uy);
    P.xy += uu_plus * ux * uy + uv_plus * (ux * ux - uy * uy);
    P.yy += uy * (uu_plus * uy + T(2) * uv_plus * ux);
  }
}

// z- becomes z+, P+ c apart; e is returned.
template <bool noise, class T, class G>
[[gnu::always_inline]] inline T gain_turn(const Planar<G>& g, const T& tau, Planar<T>& z) {
  const T e = tau - z.n;
  z.x += g.x * e;
  z.y += g.y * e;
  if constexpr (noise)
    z.n += g.n * e;
  else
    z.n = tau;
  return e;
}

template <bool noise, class T, class G>
[[gnu::always_inline]] inline T gain_slide(const G& ux, const G& uy, const Planar<G>& g,
                                           const T& tau, Planar<T>& z) {
  const T u = ux * z.x + uy * z.y, e = tau - u;
  z.n += g.n * e;
  const T along = noise ? T(g.x * e) : e, aside = g.y * e;
  z.x += along * ux - aside * uy;
  z.y += along * uy + aside * ux;
  return e;
}

// P+ c, and to the parent. full: J+ and b+ are not zero.
template <bool full, class T>
[[gnu::always_inline]] inline void add_times(const PlanarInertia<T>& P, const PlanarStep<T>& step,
                                             Planar<T>& z) {
  z.x += P.xx * step.cx + P.xy * step.cy;
  z.y += P.xy * step.cx + P.yy * step.cy;
  if constexpr (full) z.n += P.x * step.cx + P.y * step.cy;
}

// t'C t.
template <class T>
[[gnu::always_inline]] inline T across(const PlanarStep<T>& step, const PlanarInertia<T>& P) {
  return step.tt_xx * P.xx + (step.tt_xy * P.xy + step.tt_yy * P.yy);
}

// b of P+ at the parent's origin, and what is there.
template <bool full, class T>
[[gnu::always_inline]] inline void move_b(const PlanarStep<T>& step, const PlanarBody<T>& there,
                                          PlanarInertia<T>& P) {
  T x = step.tx * P.xx + there.x, y = step.tx * P.xy + there.y;
  x += step.ty * P.xy;
  y += step.ty * P.yy;
  if constexpr (full) {
    x += P.x;
    y += P.y;
  }
  P.x = x;
  P.y = y;
}

// a, and l- of the parent becomes l- of the link. What hangs on the parent's l.n, which comes last,
// is kept apart: few operations wait for it.
template <class T, class G>
[[gnu::always_inline]] inline T smooth_turn(const PlanarLink<G>& link, const Planar<G>& g,
                                            const PlanarStep<G>& step, const T& e_plus,
                                            Planar<T>& l) {
  const T rest = e_plus - g.x * l.x - g.y * l.y, before = l.n;
  const G gt = g.x * step.tx + g.y * step.ty;
  l.x += step.tx * before;
  l.y += step.ty * before;
  if (link.noise) {
    const T a = rest - (gt + g.n) * before;
    l.n += a;
    return link.sign * a;
  }
  l.n = rest - gt * before;
  return link.sign * (l.n - before);
}

template <class T, class G>
[[gnu::always_inline]] inline T smooth_slide(const PlanarLink<G>& link, const G& ux, const G& uy,
                                             const Planar<G>& g, const PlanarStep<G>& step,
                                             const T& e_plus, Planar<T>& l) {
  l.x += step.tx * l.n;
  l.y += step.ty * l.n;
  const T along = ux * l.x + uy * l.y, aside = ux * l.y - uy * l.x;
  const T rest = e_plus - g.n * l.n - g.y * aside;
  const T a = link.noise ? T(rest - g.x * along) : T(rest - along);
  l.x += ux * a;
  l.y += uy * a;
  return a;
}

// From the outboard side of joint k to the inboard one, and to the parent's origin, to which is
// added what is there. Where J+ = 0, J- of the parent is t'C-t - (t'b)^2 / D: it waits for nothing
// but the division.
template <bool forces, bool slides, bool noise, class T>
[[gnu::always_inline]] inline void cross(const PlanarLink<T>& link, const PlanarStep<T>& step,
                                         const PlanarBody<T>& there, const T& net, const T& tau,
                                         PlanarWorkspace<T>& ws, int k, PlanarInertia<T>& P,
                                         Planar<T>& z, T& size_J, T& size_m, T& margin) {
  using std::min;
  constexpr bool full = slides || noise;  // J+ and b+ are not zero
  auto& at = ws.links[k];
  const T trace = P.xx + P.yy, J_minus = P.J;  // what C+ and J+ are differences of
  T ux, uy, reach = link.reach, J = there.J, tb;
  if constexpr (slides) {
    ux = ws.apart[link.apart].ux;
    uy = ws.apart[link.apart].uy;
    reach = ws.apart[link.apart].reach;
    measure_slide<noise>(link.r, ux, uy, P, at);
  } else {
    if constexpr (!full) {
      J += across(step, P);
      tb = step.tx * P.x + step.ty * P.y;
    }
    measure_turn<noise>(link.r, P, at);
  }
  margin = min(margin, T(at.D - net * (slides ? size_m : size_J)));
  if constexpr (forces) {
    if constexpr (slides)
      at.e = gain_slide<noise>(ux, uy, at.g, tau, z) * at.inverse_D;
    else
      at.e = gain_turn<noise>(at.g, T(link.sign * tau), z) * at.inverse_D;
    add_times<full>(P, step, z);
    z.n += step.tx * z.x + step.ty * z.y;
    z.x += there.fx;
    z.y += there.fy;
  }
  size_m = trace + there.size_m;
  size_J = reach * trace + there.size_J;
  if constexpr (full) {
    size_J += T(2) * J_minus;
    P.J += J + (T(2) * (step.tx * P.x + step.ty * P.y) + across(step, P));
  } else {
    P.J = J - (tb * tb) * at.inverse_D;
  }
  move_b<full>(step, there, P);
  P.xx += there.m;
  P.yy += there.m;
}

// D and g of every link and ws.margin; with forces e+ too.
template <bool forces, class T>
[[gnu::optimize("no-tree-slp-vectorize")]] void filter(const PlanarModel<T>& model, const T* tau,
                                                       PlanarWorkspace<T>& ws) {
  const T net = model.net(), zero = T(0);
  PlanarInertia<T> P;
  Planar<T> z;
  T size_J, size_m, margin = T(1);
  for (auto& branch : ws.branches) {
    branch.P = {zero, zero, zero, zero, zero, zero};
    branch.z = {zero, zero, zero};
    branch.size_J = branch.size_m = zero;
  }
  bool carried = false;  // P and z come from link k + 1, and link k is added
  for (int k = model.nv() - 1; k >= 0; --k) {
    const PlanarLink<T>& link = model.link(k);
    if (!carried) {
      const PlanarBody<T> body = ws.template body<forces>(link, k);
      P.J = body.J;
      P.x = body.x;
      P.y = body.y;
      P.xx = P.yy = body.m;
      P.xy = z.n = zero;
      z.x = body.fx;
      z.y = body.fy;
      size_J = body.size_J;
      size_m = body.size_m;
    }
    if (link.slot >= 0) {
      const auto& branch = ws.branches[link.slot];
      add(branch.P, P);
      if constexpr (forces) add(branch.z, z);
      size_J += branch.size_J;
      size_m += branch.size_m;
    }
    carried = link.hangs_on_previous;
    PlanarBody<T> there{zero, zero, zero, zero, zero, zero, zero, zero};
    if (carried) there = ws.template body<forces>(model.link(k - 1), k - 1);
    PlanarStep<T> step{zero, zero, zero, zero, zero, zero, zero};
    if (link.parent >= 0) step = ws.step(link, k);
    T force = zero;
    if constexpr (forces) force = tau[link.dof];
    const auto across = [&]<bool slides, bool noise>() __attribute__((always_inline)) {
      cross<forces, slides, noise>(link, step, there, net, force, ws, k, P, z, size_J, size_m,
                                   margin);
    };
    if (link.slides)
      link.noise ? across.template operator()<true, true>()
                 : across.template operator()<true, false>();
    else
      link.noise ? across.template operator()<false, true>()
                 : across.template operator()<false, false>();
    if (link.parent < 0 || carried) continue;
    auto& branch = ws.branches[model.link(link.parent).slot];
    add(P, branch.P);
    if constexpr (forces) add(z, branch.z);
    branch.size_J += size_J;
    branch.size_m += size_m;
  }
  ws.margin = margin;
}

template <class T, class G>
[[gnu::always_inline]] inline T smooth(const PlanarWorkspace<G>& ws, const PlanarLink<G>& link,
                                       const PlanarStep<G>& step, const Planar<G>& g,
                                       const T& e_plus, Planar<T>& l) {
  if (!link.slides) return smooth_turn(link, g, step, e_plus, l);
  const auto& apart = ws.apart[link.apart];
  return smooth_slide(link, apart.ux, apart.uy, g, step, e_plus, l);
}

// l and a of every link.
template <class T>
void smooth(const PlanarModel<T>& model, PlanarWorkspace<T>& ws, T* a) {
  Planar<T> l;
  T check = T(0);
  for (int k = 0; k < model.nv(); ++k) {
    const PlanarLink<T>& link = model.link(k);
    const auto& at = ws.links[k];
    PlanarStep<T> step{};
    if (link.parent < 0) {
      l.n = T(0);
      l.x = model.a0_x();
      l.y = model.a0_y();
    } else {
      if (!link.hangs_on_previous) copy(ws.branches[model.link(link.parent).slot].l, l);
      step = ws.step(link, k);
      l.x += step.cx;
      l.y += step.cy;
    }
    const T acceleration = smooth(ws, link, step, at.g, at.e, l);
    a[link.dof] = acceleration;
    check += acceleration * T(0);
    if (link.slot >= 0) copy(l, ws.branches[link.slot].l);
  }
  ws.check = check;
}

}  // namespace detail

// a of the DoF in the plane, from q, qd and tau; where they stand, they stand in the model.
template <class T>
void planar_acceleration(const PlanarModel<T>& model, const T* q, const T* qd, const T* tau,
                         PlanarWorkspace<T>& ws, T* a) {
  detail::set_state<true>(model, q, qd, ws);
  detail::filter<true>(model, tau, ws);
  detail::smooth(model, ws, a);
}

// D and g of the DoF in the plane, and where the links are.
template <class T>
void planar_factor(const PlanarModel<T>& model, const T* q, PlanarWorkspace<T>& ws) {
  detail::set_state<false, T>(model, q, nullptr, ws);
  detail::filter<false, T>(model, nullptr, ws);
}

}  // namespace kalmarm
