// How far rounding in the two sweeps of forward dynamics moves accelerations.
//
// Forces, tips to base: an error w of the force on link k acts on the robot as a force on that
// link. With |x|_M^2 = x' M x, its response has the energy
//   |da|_M^2 = w' Omega(k) w <= w' M(k)^-1 w,    Omega(k) = J(k) M^-1 J(k)'               (1)
// since the other links only add inertia: the body absorbs the error. Where a sweep makes |w(i)| <=
// c u |z(i)| of a number z(i) of z-(k), and the like for the turns and the translation to the
// parent, with the weights w(i) of rounding_weights.hpp,
//   |da|_M^2 <= (c u)^2 N,    N = sum over k and i of w(i) z(i)^2                         (2)
// A body that cannot absorb (massless, a point, or light beside what passes through it) hands
// S = w w' on, of which the traces are known, and then the share of link k in N is
//   h / D,  h = H S H';   S+ <= 2 (S + h g g'),  S(parent) += phi S+ phi'                  (3)
// A link's own part of S is |z(i)|^2 of its moments and forces, and of its moments |p|^2 |f|^2 too, with f
// the forces of z and p its children's levers: the moment p x f may cancel, what rounding left of it does not.
// Euclid's norm is the larger by at most the root of the trace:
//   |x|^2 <= T |x|_M^2,  T = trace M^-1 = sum over k of v(k),  v(k) = 1/D + g' Omega(parent) g
//   Omega(k) <= 2 (phi' Omega(parent) phi + H' H v(k)),  Omega(k) <= M(k)^-1,  v(k) <= 1/r(k)  (4)
// of whose blocks of turning and of moving the traces are carried, outward. So
//   |da|^2 <= T (c u)^2 N                                                                (5)
// Sweeps take one T for all states of a robot, (3) of least_inertia.hpp, and
//   v(k) <= 1 / mu(k)                                                                     (6)
// (3) and (4) are for robots of which no constant is known (LoweredModel::rounding_depends_on_state): a link between
// the hinges of one body has no mass, and what its next joint meets is known by D alone. There N has (3) of the
// links that cannot absorb, (2) of the others, T is that of the state, and so is each joint's own scale, mu(k) =
// 1 / v(k). Weights, and so N, are in units of LoweredModel::rounding_unit. (2) takes 18 flops a link.
//
// z- is a sum whose terms may cancel within one link: of a body that is turned about a point far
// away, or nearly symmetric, b = (w x I w;  W h) is less than what it is summed from. With t(i) the
// largest of these terms over w^2, rows of I and h (bias_terms of rounding_weights.hpp),
//   N += w^4 sum over i of w(i) t(i)^2                                                    (2')
// which is one number a body.
//
// A force from outside is rounded wherever it is turned and moved on its way to link k (kinematics/acting.hpp), and
// may cancel there, as a moment about a far origin does, and in z-(k). The traces of S gain
//   sum of |n|^2,  sum of |f|^2         over its way, of its moments and forces              (13)
//
// Motions, base to tips: an error x(k) of a(k) = e+ - g' l+ is one of e+(k), so that
// (I + K*) da = x, and from M = (I + K) D (I + K*),
//   |da|_M^2 = sum over k of D(k) x(k)^2 <= (c u)^2 E,
//   E = sum over k of D(k) (e+(k)^2 + sum over i of g(i)^2 l+(i)^2)                       (7)
// which counts where a gain is huge, of a joint that hardly turns itself. It takes 18 flops a link.
//
// Inertias, tips to base: an error dP of P+(k) is one of the force P+ l+ on body k. With |dP| <= c u P, and the
// accelerations of bodies at rest, which are those of gravity,
//   |da|_M^2 <= (c u)^2 G,    G = |gravity|^2 sum of m(k)                                 (9)
// since what moves them more is a itself. It counts where gravity, though it moves no joint, is far above a: a
// search found rows of float32 that were wrong by 60 % of an a of 0.01 rad/s^2. An error eps of D alone moves a
// by no more than |da|_M^2 <= eps^2 (E + G), since E and G bound |a|_M^2 but for a factor of 2.
//
// An answer of forward dynamics is accepted where
//   T (c u)^2 (N + E + G) < e^2 max(|a|, 0.01 |gravity|)^2                               (8)
// by (2), (6), (7) and (9), with e the error that is accepted (claims.hpp) and c = rounding_constant
// (constants.hpp), an empirical constant. Beside gravity a smaller a is nothing. Any other answer, and
// one of a sweep that fails the test of D (rounding_test.hpp), is left to the next rung. e is far below
// what is promised, so that what no sum counts has room.
//
// x = M^-1 tau by factors that are kept sweeps forces and motions in the same way (columns.hpp), at
// rest and without gravity: it is accepted where
//   T ((c u)^2 (N + E) + (c_D u)^2 E) < e^2 |x|^2                                         (8')
// c_D u, c_D = roundings_of_D, stands for an error of D that was not measured: what the
// test of D lets pass moves x by more than e where T E is far above |x|^2.
//
// Column j of X = M^-1 is such an x, with |X_j|_M^2 = X(j,j) and a(k) = X(k,j). What rounding of a(k) moves
// is bounded by one number for all columns: with Omega+(k) = phi' Omega(parent) phi the covariance of l+,
// X(k,j)^2 <= X(k,k) X(j,j) and l+(i)^2 <= Omega+(i,i) X(j,j), so that
//   |dX_j|_M^2 / X(j,j) <= (c u)^2 S,  S = sum over k of D(k) (X(k,k) + sum over i of g(i)^2 Omega+(i,i))
//                                                                                        (11)
// and an entry's error |dX(i,j)| <= sqrt(X(i,i)) |dX_j|_M. X is accepted where (c u)^2 S < e^2. The
// second sum, of terms of g' l+ that may cancel, is below one number for all states
// (terms_of_columns.hpp); where that is too much it is taken by (4), whose v(k) is X(k,k) here.
//
// The same sums say how wrong an answer is. In each joint's own scale |a|_s^2 = sum of mu(k) a(k)^2
// is about |a|_M^2 and mostly below it, so that of |da|_M / |a|_M
//   error^2 = ((c u)^2 (N + E + G) + u^2 R) / max(|a|_s, 0.01 |gravity| mean of sqrt(mu))^2   (10)
// is an estimate. An answer whose estimate is above e is left to the next rung too.
//
// Last, a(k) = H l- - H l+ is rounded, and no other joint takes that back, since without joint noise H l- is a
// sum of its own. Entries that are rounded apart move a by
//   |da|_M^2 = u^2 sum of M(k,k) a(k)^2 <= u^2 R,   R = sum over k of I(k) a(k)^2         (12)
// with I(k) the largest that M(k,k) can be (lowered_model.hpp). It is most of the error where large entries of a
// cancel and move heavy links little, as in a long chain that is stretched out.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "algorithms/fast/covariance/rounding_test.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"

namespace kalmarm {

// T of a state of which none but that for all states is known.
template <class T>
T no_trace() {
  return T(std::numeric_limits<typename Lanes<T>::Scalar>::infinity());
}

// Of the accelerations of a sweep, of one state or one in every lane.
template <class T>
struct AccelerationSums {
  T noise, energy;  // N and E
  T squares, size;  // |a|^2 and |a|_s^2
  T rounding;       // R of (12)
  T trace = no_trace<T>();
};

// The share of a link in N by (2), from z-.
template <class T, class S>
KALMARM_INLINE T absorbed(const RoundingWeights<S>& w, const Sixfold<T>& z) {
  return (w.Axx * (z.x * z.x) + w.Ayy * (z.y * z.y) + w.Azz * (z.z * z.z)) +
         (w.Cxx * (z.u * z.u) + w.Cyy * (z.v * z.v) + w.Czz * (z.w * z.w));
}

// The share of a link in E by (7) but for D, from l+. g and D: of T, or the same
// for every lane of T.
template <class T, class S, class U>
KALMARM_INLINE T motion_terms(const LoweredLink<S>& link, const Sixfold<U>& g, const T& e_plus,
                              const Sixfold<T>& l) {
  const auto square = [](const T& x) KALMARM_INLINE_LAMBDA { return x * x; };
  const T turned = square(g.x * l.x) + square(g.y * l.y);
  const T moved = square(g.u * l.u) + square(g.v * l.v);
  const T own = link.slides ? T(square(g.z * l.z) + square(link.has_noise ? T(g.w * l.w) : l.w))
                            : T(square(g.w * l.w) + square(link.has_noise ? T(g.z * l.z) : l.z));
  return square(e_plus) + (turned + moved + own);
}
template <class T, class S>
KALMARM_INLINE T motion_noise(const LoweredLink<S>& link, const Sixfold<T>& g, const T& inverse_D,
                              const T& e_plus, const Sixfold<T>& l) {
  return motion_terms(link, g, e_plus, l) / inverse_D;
}

// N by (2), from z- of all links.
template <class T, class S>
T force_noise(const LoweredModel<S>& model, const std::vector<Sixfold<T>>& z) {
  T sum = T(S(0));
  if constexpr (std::is_same_v<T, S>) {  // several numbers at once
    static_assert(sizeof(Sixfold<T>) == 6 * sizeof(T));
    using Numbers = Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>>;
    const Eigen::Index n = model.weights().size();
    if (n == 0) return sum;
    const Numbers w(model.weights().data(), n), numbers(&z[0].x, n);
    sum = (w * numbers * numbers).sum();
  } else {
    for (int k = 0; k < model.nv(); ++k)
      if (model.body(k).weights.counts) sum += absorbed(model.body(k).weights, z[k]);
  }
  return sum;
}

// Memory of one state, or of one in every lane.
template <class T>
class ForceNoise {
 public:
  template <class S>
  explicit ForceNoise(const LoweredModel<S>& model)
      : pending_(model.nv()),
        responses_(model.nv()),
        variances_(model.nv()),
        largest_variance_(model.largest_variance()) {}

  // T for all states.
  const T& largest_variance() const { return largest_variance_; }

  // Before `charge` of all links, tips to base.
  void begin() { std::fill(pending_.begin(), pending_.end(), Traces{T(0.0), T(0.0)}); }

  // The share of link k in N: by (3) where it cannot absorb, else by (2). factors: links of (d, g, inverse_D)
  // and matrices, as columns.hpp has them.
  template <class S, class Factors>
  T charge(const LoweredModel<S>& model, const Factors& factors, int k, const Sixfold<T>& z);

  // Before that: rounding of the bias of a link that cannot absorb, by (2'); ww: |w|^2.
  template <class S>
  void charge_bias(const LoweredModel<S>& model, int k, const T& ww) {
    if (model.body(k).weights.absorbs()) return;
    const detail::BiasTerms terms = detail::bias_terms(model.body(k));
    pending_[k].turning += T(S(terms.moments.sum())) * (ww * ww);
    pending_[k].moving += T(S(terms.force)) * (ww * ww);
  }

  // And of forces from outside, by (13).
  void charge_acting(int k, const T& moments, const T& forces) {
    pending_[k].turning += moments;
    pending_[k].moving += forces;
  }

  // T of (4), or for all states where that is less.
  template <class S, class Factors>
  T trace(const LoweredModel<S>& model, const Factors& factors);

  // v(k) of (4), of the last trace.
  const T& variance(int k) const { return variances_[k]; }

  // S of (11) for X = M^-1 by these factors; diagonal(k): X(k,k).
  template <class S, class Factors, class Diagonal>
  T energy_of_columns(const LoweredModel<S>& model, const Factors& factors,
                      const Diagonal& diagonal);

 private:
  struct Traces {
    T turning, moving;  // of moments and forces in (3), of motions in (4)
  };

  static T squares(const T& x, const T& y, const T& z) { return x * x + y * y + z * z; }

  // Of g, whose own component is 1 where there is no joint noise, and may then not be stored; of T, or the
  // same for every lane of T.
  template <class S, class U>
  static Traces sizes(const LoweredLink<S>& link, const Sixfold<U>& g) {
    const U one = U(S(1)), own = link.slides ? g.w : g.z, h = link.has_noise ? U(own * own) : one;
    const U turning = g.x * g.x + g.y * g.y + (link.slides ? U(g.z * g.z) : h);
    const U moving = g.u * g.u + g.v * g.v + (link.slides ? h : U(g.w * g.w));
    return {T(turning), T(moving)};
  }

  // Of Omega+ in (4), once Omega of the parent is known.
  template <class S, class Factors>
  Traces arrive(const LoweredModel<S>& model, const Factors& factors, int k) const {
    const LoweredLink<S>& link = model.link(k);
    if (link.parent < 0) return {T(S(0)), T(S(0))};
    const Traces& there = responses_[link.parent];
    return {there.turning, T(S(2)) * there.moving + reach(model, factors, k) * there.turning};
  }

  // Of Omega in (4).
  template <class S>
  void leave(const LoweredModel<S>& model, int k, const Traces& plus, const T& v) {
    using std::min;
    const RoundingWeights<S>& weights = model.body(k).weights;
    const T two = T(S(2));
    const S unit = model.rounding_unit();
    Traces Omega = {two * plus.turning, two * plus.moving};
    (model.link(k).slides ? Omega.moving : Omega.turning) += two * v;
    responses_[k] = {min(Omega.turning, T(weights.moment / unit)),
                     min(Omega.moving, T(weights.force / unit))};
  }

  // At least the sum over i of g(i)^2 Omega+(i,i), and half of g' Omega+ g.
  template <class S, class U>
  static T weighed(const LoweredLink<S>& link, const Sixfold<U>& g, const Traces& plus) {
    const Traces size = sizes(link, g);
    return size.turning * plus.turning + size.moving * plus.moving;
  }

  // 2 |p|^2 of phi.
  template <class S, class Factors>
  static T reach(const LoweredModel<S>& model, const Factors& factors, int k) {
    const LoweredLink<S>& link = model.link(k);
    if (link.kind == LoweredLink<S>::Kind::matrix) {
      const auto& p = factors.matrices[link.varying].p;
      return T(S(2)) * squares(T(p[0]), T(p[1]), T(p[2]));
    }
    if (link.kind == LoweredLink<S>::Kind::cyclic) return T(S(0));
    if (!link.slides) return T(model.body(k).reach);
    return T(model.body(k).reach) + T(S(4)) * T(factors.links[k].d * factors.links[k].d);
  }

  std::vector<Traces> pending_;    // S of (3)
  std::vector<Traces> responses_;  // Omega of (4)
  std::vector<T> variances_;       // v of (4)
  T largest_variance_;
};

template <class T>
template <class S, class Factors>
T ForceNoise<T>::charge(const LoweredModel<S>& model, const Factors& factors, int k,
                        const Sixfold<T>& z) {
  const LoweredLink<S>& link = model.link(k);
  const RoundingWeights<S>& w = model.body(k).weights;
  Traces sum = pending_[k];
  if (w.absorbs()) return absorbed(w, z) + (w.moment * sum.turning + w.force * sum.moving);
  if (w.counts) {
    const T moving = squares(z.u, z.v, z.w);
    sum.turning += squares(z.x, z.y, z.z) + T(w.reach) * moving;
    sum.moving += moving;
  }
  const auto& at = factors.links[k];
  const T two = T(S(2)), h = link.slides ? sum.moving : sum.turning;
  if (link.parent >= 0) {
    const Traces g = sizes(link, at.g);
    const Traces plus = {two * (sum.turning + h * g.turning), two * (sum.moving + h * g.moving)};
    Traces& to = pending_[link.parent];
    to.turning += two * plus.turning + reach(model, factors, k) * plus.moving;
    to.moving += plus.moving;
  }
  return model.rounding_unit() * at.inverse_D * h;
}

// T of (4).
template <class T>
template <class S, class Factors>
T ForceNoise<T>::trace(const LoweredModel<S>& model, const Factors& factors) {
  using std::min;
  T sum = T(S(0));
  for (int k = 0; k < model.nv(); ++k) {
    const auto& at = factors.links[k];
    const Traces plus = arrive(model, factors, k);
    T v = T(at.inverse_D) + T(S(2)) * weighed(model.link(k), at.g, plus);
    if (const S mu = model.least_inertias()[k]; mu > S(0)) v = min(v, T(S(1) / mu));
    variances_[k] = v;
    sum += v;
    leave(model, k, plus, v);
  }
  return min(sum, largest_variance_);
}

template <class T>
template <class S, class Factors, class Diagonal>
T ForceNoise<T>::energy_of_columns(const LoweredModel<S>& model, const Factors& factors,
                                   const Diagonal& diagonal) {
  T sum = T(S(0));
  for (int k = 0; k < model.nv(); ++k) {
    const auto& at = factors.links[k];
    const Traces plus = arrive(model, factors, k);
    const T v = diagonal(k);
    sum += (v + weighed(model.link(k), at.g, plus)) / at.inverse_D;
    leave(model, k, plus, v);
  }
  return sum;
}

}  // namespace kalmarm
