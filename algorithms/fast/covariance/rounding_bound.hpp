// How far rounding can have moved D(k) of the conventional form, at one state: a bound for those whose
// margin (filter.hpp) is not positive, which says whether their factors are good enough to refine an
// answer by, and which joint is at fault.
//
// The sweep's P-(k) is the exact one of its link's body, of its children's P+, and of an error E(k)
// that rounding makes there. To first order an error e of P- passes a joint and a link as
//   e+ = psi e psi',  e(parent) = phi e+ phi',    psi = I - gH                          (1)
// (P+ is the least of psi P- psi' + g r g' over all g, so that a change of g does not count.) Let
// -c u N(k) <= E(k) <= c u N(k) in the order of positive semidefinite matrices (Loewner's). Then
// -c u S <= e <= c u S for
//   S-(k) = N(k) + sum over children of phi S+ phi',  S+ = psi S- psi'                  (2)
//   |error of D(k)| / D(k) <= c u H S-(k) H' / D(k) = c u loss(k)                       (3)
// (1) to (3) are exact inequalities but for a factor of 1 / (1 - c u loss(j)) for every joint j
// outboard of k: the change of g that (1) leaves out is psi e H' H e psi' / (D + H e H'), and
// e H' H e <= (c u)^2 (H S H') S where -c u S <= e <= c u S.
//
// N(k), with P^ = P+ as it is turned, factor by factor of phi: |P(i,j)|^2 <= P(i,i) P(j,j), so
// every term that an entry (i,j) is summed from is below the root of N(i,i) N(j,j) if N(i,i) holds
//   P(i,i)               the body's numbers, sums over children, the update g (P-H')'   (4)
//   w P^(i,i), w = sin^2, of the axes x and y of a rotation, on these axes after it: xx - delta and
//     yy + delta (congruence.hpp) keep the errors of xx and yy where these two cancel, so that a
//     turn by a quarter leaves the small number with the error of the large one; the traces of
//     moments and forces where the rotation is a matrix                                 (5)
//   t / c (P^(x,x) + P^(y,y)) where the angle is a sum, wrong by u t, t = |offset| + |angle|, or
//     |offset| where sincos.hpp reduces it exactly: with a quarter turn J,
//     u t (J P^ + P^ J') <= u t (P^ + J P^ J')                                         (5')
//     Constants of float and double are rounded once, from a wider precision. Those of DoubleDouble
//     are worked out in it: sin alpha is right to u, relatively, but the offset to u alone
//     (test_double_double.cpp), and 1 takes the place of |offset|
//   d^2 P^(j,j)          of forces along the other two axes j, beside a translation by d along z,
//     which the others may take back; and beside one by d0 where d is a slide's sum d0 + q  (6)
//   the traces (4) of kinematics/loads.hpp of what a call adds to the link's body
// The translations by p after the last rotation are along three axes: none takes back what another
// has added, and N after them, or N before them, moved by phi, hold what they sum. Six rows, each
// within a few roundings of sizes below N, make c = 40 or so in (3) a bound that is proven.
// Roundings do not conspire: c = rounding_constant_of_P was never below the error of any sweep against
// multi-precision (test_rounding_bound.cpp says how near it comes).
//
// P and S are the two lanes of one number, in double, so that one congruence moves both. The
// measurement is that of any X at once, X+ = X - g b' - b g', b = X H' - g (H X H' + r) / 2, r in
// P's lane alone. In units of c u, S is the same for float and double but for P's own rounding.
// About 300 operations on pairs a hinge; no forces, so that what weights and velocities lose is
// not seen.
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "algorithms/fast/covariance/added_loads.hpp"
#include "algorithms/fast/covariance/filter.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// Relative errors of D, of the joint where they are largest.
struct RoundingLoss {
  double bound = 0;
  int joint = -1;
  double D = 0, scale = 0;  // of that joint; scale: its error, c u H S- H'
};

template <class S>
class RoundingBound {
 public:
  explicit RoundingBound(const LoweredModel<S>& model)
      : placed_(model), sums_(model.branch_count()) {}

  // At q (nq) with these loads, tips to base as far as the first joint whose bound is `last` or more.
  KALMARM_NOINLINE KALMARM_SWEEP RoundingLoss
  look(const LoweredModel<S>& model, const S* q, const Acting<S>& loads = {},
       double last = std::numeric_limits<double>::infinity());

 private:
  using Number = std::conditional_t<(std::numeric_limits<S>::digits > 53), S, double>;
  using Both = Pack<Number, 2>;  // P's number and S's

  struct Placed : Placements<S> {
    struct Link {
      S d;
    };
    std::vector<Link> links;

    explicit Placed(const LoweredModel<S>& model) : Placements<S>(model), links(model.nv()) {}
  };

  static Both both(const Number& P, const Number& of_S) {
    return Both::of(typename Both::Vector{P, of_S});
  }
  static Both in_P(const Number& x) { return both(x, 0); }
  static Both in_S(const Number& x) { return both(0, x); }

  static LoweredBody<Both> in_P(const LoweredBody<S>& body) {
    return {in_P(body.r),
            in_P(body.m),
            {in_P(body.h[0]), in_P(body.h[1]), in_P(body.h[2])},
            in_P(body.Ixx),
            in_P(body.Ixy),
            in_P(body.Ixz),
            in_P(body.Iyy),
            in_P(body.Iyz),
            in_P(body.Izz),
            Both(0),
            {}};
  }

  // (4)
  KALMARM_INLINE static void add_sizes(Articulated<Both>& X) {
    for (Both* x : {&X.Axx, &X.Ayy, &X.Azz, &X.Cxx, &X.Cyy, &X.Czz}) *x += in_S(x->v[0]);
  }

  // P^(i,i) of the two axes of a rotation, moments and forces, for (5).
  struct Turned {
    Both &Ax, &Ay, &Cx, &Cy;
    Number ax = Ax.v[0], ay = Ay.v[0], cx = Cx.v[0], cy = Cy.v[0];

    KALMARM_INLINE void add(const Number& w) const {
      Ax += in_S(w * ax);
      Ay += in_S(w * ay);
      Cx += in_S(w * cx);
      Cy += in_S(w * cy);
    }
  };

  // (5') about z.
  KALMARM_INLINE static void add_of_angle(double t, Articulated<Both>& X) {
    const Number w(t / rounding_constant_of_P);
    const Both moments = in_S(w * (X.Axx.v[0] + X.Ayy.v[0]));
    const Both forces = in_S(w * (X.Cxx.v[0] + X.Cyy.v[0]));
    X.Axx += moments;
    X.Ayy += moments;
    X.Cxx += forces;
    X.Cyy += forces;
  }

  // (6): dd = d^2.
  KALMARM_INLINE static void add_of_lever(const Number& dd, Articulated<Both>& X) {
    X.Axx += in_S(dd * X.Cyy.v[0]);
    X.Ayy += in_S(dd * X.Cxx.v[0]);
  }

  // Rows and columns of moments and of forces change places: a slide is measured as a hinge is.
  KALMARM_INLINE static Articulated<Both> exchanged(const Articulated<Both>& X) {
    return {X.Cxx, X.Cxy, X.Cyy, X.Cxz, X.Cyz, X.Czz, X.Bxx, X.Byx, X.Bxy, X.Byy, X.Bzx,
            X.Bzy, X.Bxz, X.Byz, X.Bzz, X.Axx, X.Axy, X.Ayy, X.Axz, X.Ayz, X.Azz};
  }

  KALMARM_INLINE static void measure(const Number& r, Articulated<Both>& X, RoundingLoss& loss,
                                     int k);
  KALMARM_INLINE void to_parent(const LoweredModel<S>& model, int k, const S* q,
                                Articulated<Both>& X) const;

  Placed placed_;
  std::vector<Articulated<Both>> sums_;  // of links with several children, over them
};

template <class S>
void RoundingBound<S>::measure(const Number& r, Articulated<Both>& X, RoundingLoss& loss, int k) {
  const double unit = rounding_constant_of_P * static_cast<double>(unit_roundoff<S>());
  const Number D = X.Azz.v[0] + r, S_zz = X.Azz.v[1], inverse_D = Number(1) / D;
  const double size(D), scale(S_zz + r);  // r is rounded too
  if (!(unit * scale < loss.bound * size)) {
    loss.bound = size > 0 ? unit * scale / size : std::numeric_limits<double>::infinity();
    loss.joint = k;
    loss.D = size;
    loss.scale = unit * scale;
  }
  const auto gain = [&](const Both& x) { return Both(x.v[0] * inverse_D); };
  const Both gx = gain(X.Axz), gy = gain(X.Ayz), gu = gain(X.Bzx), gv = gain(X.Bzy),
             gw = gain(X.Bzz), half = both(D / Number(2), S_zz / Number(2));
  const Both bx = X.Axz - gx * half, by = X.Ayz - gy * half, bu = X.Bzx - gu * half,
             bv = X.Bzy - gv * half, bw = X.Bzz - gw * half;
  X.Axx -= gx * bx + bx * gx;
  X.Axy -= gx * by + bx * gy;
  X.Ayy -= gy * by + by * gy;
  X.Bxx -= gx * bu + bx * gu;
  X.Bxy -= gx * bv + bx * gv;
  X.Bxz -= gx * bw + bx * gw;
  X.Byx -= gy * bu + by * gu;
  X.Byy -= gy * bv + by * gv;
  X.Byz -= gy * bw + by * gw;
  X.Cxx -= gu * bu + bu * gu;
  X.Cxy -= gu * bv + bu * gv;
  X.Cyy -= gv * bv + bv * gv;
  X.Cxz -= gu * bw + bu * gw;
  X.Cyz -= gv * bw + bv * gw;
  X.Czz -= gw * bw + bw * gw;
  // Row z: HP+ = r g', and psi's is r / D times that of I.
  const Both left = Both(r * inverse_D), old = in_S(S_zz);
  X.Axz = left * (X.Axz - gx * old);
  X.Ayz = left * (X.Ayz - gy * old);
  X.Bzx = left * (X.Bzx - gu * old);
  X.Bzy = left * (X.Bzy - gv * old);
  X.Bzz = left * (X.Bzz - gw * old);
  X.Azz = X.Azz * left * both(1, r * inverse_D);
}

template <class S>
void RoundingBound<S>::to_parent(const LoweredModel<S>& model, int k, const S* q,
                                 Articulated<Both>& X) const {
  using Kind = typename LoweredLink<S>::Kind;
  const LoweredLink<S>& link = model.link(k);
  const auto turned_z = [&](const Turn<S>& by) {
    const Turned before{X.Axx, X.Ayy, X.Cxx, X.Cyy};
    rotate_z(by, X);
    before.add(Number(by.ss));
  };
  switch (link.kind) {
    case Kind::cyclic:
      X = cycle(X);
      return;
    case Kind::matrix: {
      const auto& phi = placed_.matrices[link.varying];
      Rotation<Both> R;
      Number reach(0);  // (6)
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) R.R[i][j] = phi.R.R[i][j];
        reach += link.p[i] * link.p[i];
        if (link.coordinate == Coordinate::position) reach += q[i] * q[i];
      }
      const Both moments = X.Axx + X.Ayy + X.Azz, forces = X.Cxx + X.Cyy + X.Czz;
      for (Both* x : {&X.Axx, &X.Ayy, &X.Azz}) *x += in_S(moments.v[0] + reach * forces.v[0]);
      for (Both* x : {&X.Cxx, &X.Cyy, &X.Czz}) *x += in_S(forces.v[0]);
      rotate(R, X);
      translate_x(phi.p[0], X);
      translate_y(phi.p[1], X);
      translate_z(phi.p[2], X);
      return;
    }
    case Kind::screws:
      break;
  }
  if (link.slides) {
    const Number d = placed_.links[k].d, own = link.d;
    add_of_lever(d * d + own * own, X);
    translate_z(d, X);
    turned_z(model.uncommon(link).turn);
  } else {
    if (link.d != S(0)) {
      const Number d = link.d;
      add_of_lever(d * d, X);
      translate_z(link.d, X);
    }
    const int at = link.varying;
    if (const double offset(model.hinges().offset[at]); offset != 0) {
      using Narrow = std::conditional_t<std::is_same_v<S, float>, float, double>;
      const double angle = std::abs(static_cast<double>(placed_.q[at]) + offset);
      const double of_offset = std::is_same_v<Wider<S>, S> ? 1 : std::abs(offset);
      const bool is_sum = angle <= detail::SinCosConstants<Narrow>::farthest;
      add_of_angle(of_offset + (is_sum ? angle : 0), X);
    }
    turned_z(Turn<S>(placed_.cos[at], placed_.sin[at]));
  }
  if (link.alpha.s != S(0)) {
    const Turned before{X.Ayy, X.Azz, X.Cyy, X.Czz};
    X = rotate_x(link.alpha, X);
    before.add(Number(link.alpha.ss));
  } else if (link.alpha.c < S(0)) {
    X = rotate_x(link.alpha, X);
  }
  if (link.turned) turned_z(model.uncommon(link).theta);
  if (link.p[0] != S(0)) translate_x(link.p[0], X);
  if (link.p[1] != S(0)) translate_y(link.p[1], X);
  if (link.p[2] != S(0)) translate_z(link.p[2], X);
}

template <class S>
RoundingLoss RoundingBound<S>::look(const LoweredModel<S>& model, const S* q,
                                    const Acting<S>& loads, double last) {
  detail::set_placements(model, q, placed_);
  for (Articulated<Both>& sum : sums_) set_zero(sum);
  detail::for_each_load(model, loads, [&](std::size_t, int link, const Load<S>& load) {
    Articulated<Both>& sum = sums_[model.link(link).branch];
    add_body(sum, in_P(load.body));
    const Both moment = in_S(load.moment), force = in_S(load.force);
    for (Both* x : {&sum.Axx, &sum.Ayy, &sum.Azz}) *x += moment;
    for (Both* x : {&sum.Cxx, &sum.Cyy, &sum.Czz}) *x += force;
  });
  RoundingLoss loss;
  Articulated<Both> X;
  bool carried = false;
  for (int k = model.nv() - 1; k >= 0; --k) {
    const LoweredLink<S>& link = model.link(k);
    const LoweredBody<Both> body = in_P(model.body(k));
    if (carried)
      add_body(X, body);
    else
      set_body(X, body);
    if (link.branch >= 0) {
      add_sizes(X);
      add(X, sums_[link.branch]);
    }
    add_sizes(X);
    if (link.slides) {
      Articulated<Both> swapped = exchanged(X);
      measure(model.body(k).r, swapped, loss, k);
      X = exchanged(swapped);
    } else {
      measure(model.body(k).r, X, loss, k);
    }
    if (!(loss.bound < last)) break;
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    to_parent(model, k, q + link.q_index, X);
    if (carried) continue;
    Articulated<Both>& sum = sums_[model.link(link.parent).branch];
    add(sum, X);
    add_sizes(sum);
  }
  return loss;
}

}  // namespace kalmarm
