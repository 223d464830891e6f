// How far rounding of the forces of a sweep, tips to base, moves accelerations. An error w of the
// force on link k acts on the robot as a force on that link. With |x|_M^2 = x' M x, its response has
// the energy
//   |da|_M^2 = w' Omega(k) w <= w' M(k)^-1 w,    Omega(k) = J(k) M^-1 J(k)'               (1)
// since the other links only add inertia: the body absorbs the error. Where a sweep makes |w(i)| <=
// c u |z(i)| of a number z(i) of z-(k), and the like for the turns and the translation to the
// parent, with the weights w(i) of rounding_weights.hpp,
//   |da|_M^2 <= (c u)^2 N,    N = sum over k and i of w(i) z(i)^2                         (2)
// A body that cannot absorb (massless, a point, or light beside what passes through it) hands
// S = w w' on, of which the traces are known, and then the share of link k in N is
//   h / D,  h = H S H';   S+ <= 2 (S + h g g'),  S(parent) += phi S+ phi'                  (3)
// Euclid's norm is the larger by at most the root of the trace:
//   |x|^2 <= T |x|_M^2,  T = trace M^-1 = sum over k of v(k),  v(k) = 1/D + g' Omega(parent) g
//   Omega(k) <= 2 (phi' Omega(parent) phi + H' H v(k)),  Omega(k) <= M(k)^-1,  v(k) <= 1/r(k)  (4)
// of whose blocks of turning and of moving the traces are carried, outward. So
//   |da|^2 <= T (c u)^2 N                                                                (5)
// Most states are content with one T for all states of a robot. The DoF x of a joint are what the
// accelerations of its two bodies differ by, so that
//   sum over a joint of v(k) <= 2 trace (M(k)^-1 + phi' M(parent)^-1 phi),  v(k) <= 1/r(k)  (6)
// Weights, and so N, are in units of rounding_unit. (2) takes 18 flops a link.
//
// A sweep of forward dynamics is believed where
//   T (c u)^2 N < e^2 max(|a|, 0.01 |gravity|)^2                                          (7)
// by (2) and (6), with e = largest_error_of_a and c = 1: roundings do not conspire. Beside gravity a
// smaller a is nothing. What this suspects gets a second look, by (3) and (4). What the test of D
// suspects (rounding_test.hpp) has the error eps of D too, by rounding_bound.hpp:
//   T ((c u)^2 N + eps^2 E) < e^2 max(|a|, 0.01 |gravity|)^2                              (8)
//   E = sum of e(k)^2 / D(k) + |gravity|^2 sum of m(k)
// of which E bounds |a|_M^2 but for a factor of 2. What is suspected still, the certified form
// answers. Rounding of the motions, base to tips, is not counted: it is of the size of u (|e+| + |a|)
// but where a gain is huge, of a joint that hardly turns itself: then |g(k)'| |lambda| counts, and a
// search finds it (docs/laboratory.md).
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <utility>
#include <vector>

#include "algorithms/fast/covariance/rounding_test.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"

namespace kalmarm {

// The relative error of a that is not answered without a word.
template <class S>
inline constexpr double largest_error_of_a = std::is_same_v<S, float> ? 1e-2 : 1e-6;

// The share of a link in N by (2), from z-.
template <class T, class S>
KALMARM_INLINE T absorbed(const RoundingWeights<S>& w, const Sixfold<T>& z) {
  return (w.Axx * (z.x * z.x) + w.Ayy * (z.y * z.y) + w.Azz * (z.z * z.z)) +
         (w.Cxx * (z.u * z.u) + w.Cyy * (z.v * z.v) + w.Czz * (z.w * z.w));
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
  using S = typename Lanes<T>::Scalar;

  explicit ForceNoise(const LoweredModel<S>& model)
      : pending_(model.nv()), responses_(model.nv()), constant_trace_(constant_trace(model)) {}

  // T of (6).
  S constant_trace() const { return constant_trace_; }

  // Before `charge` of all links, tips to base.
  void begin() { std::fill(pending_.begin(), pending_.end(), Traces{T(S(0)), T(S(0))}); }

  // The share of link k in N: by (2) where that is below `little`, else by (3). factors: links of
  // (d, g, inverse_D) and matrices, as columns.hpp has them.
  template <class Factors>
  T charge(const LoweredModel<S>& model, const Factors& factors, int k, const Sixfold<T>& z,
           const T& little);

  // T of (4).
  template <class Factors>
  T trace(const LoweredModel<S>& model, const Factors& factors);

 private:
  struct Traces {
    T turning, moving;  // of moments and forces in (3), of motions in (4)
  };

  static T squares(const T& x, const T& y, const T& z) { return x * x + y * y + z * z; }

  // Of g, whose own component is 1 where there is no joint noise, and may then not be stored.
  static Traces sizes(const LoweredLink<S>& link, const Sixfold<T>& g) {
    const T one = T(S(1)), own = link.slides ? g.w : g.z, h = link.noise ? T(own * own) : one;
    return {g.x * g.x + g.y * g.y + (link.slides ? T(g.z * g.z) : h),
            g.u * g.u + g.v * g.v + (link.slides ? h : T(g.w * g.w))};
  }

  // 2 |p|^2 of phi.
  template <class Factors>
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

  static double constant_trace(const LoweredModel<S>& model);

  std::vector<Traces> pending_;    // S of (3)
  std::vector<Traces> responses_;  // Omega of (4)
  S constant_trace_;
};

// T of (6).
template <class T>
double ForceNoise<T>::constant_trace(const LoweredModel<S>& model) {
  const auto own = [&](int k) {
    if (k < 0) return std::pair{0.0, 0.0};
    const RoundingWeights<S>& w = model.body(k).weights;
    const auto unit = static_cast<double>(rounding_unit<S>());
    return std::pair{static_cast<double>(w.moment) / unit, static_cast<double>(w.force) / unit};
  };
  double sum = 0;
  for (const LinkRun& run : model.runs())
    for (int k = run.at_once ? run.last : run.first; k <= run.last; ++k) {
      const int first = run.at_once ? run.first : k;
      const LoweredLink<S>& link = model.link(first);
      const auto [turning, moving] = own(k);
      const auto [parents_turning, parents_moving] = own(link.parent);
      const double reach = static_cast<double>(model.body(first).reach);
      const double of_turns = turning + parents_turning;
      const double of_moves = moving + 2 * parents_moving + reach * parents_turning;
      if (!run.at_once)
        sum += std::min(2 * (link.slides ? of_moves : of_turns),
                        1 / static_cast<double>(model.body(k).r));
      else if (run.last - first < 5)
        sum += 2 * of_turns;
      else  // it is where its position says
        sum += link.parent < 0 ? 2 * (of_turns + of_moves) : detail::no_body;
    }
  return sum;
}

template <class T>
template <class Factors>
T ForceNoise<T>::charge(const LoweredModel<S>& model, const Factors& factors, int k,
                        const Sixfold<T>& z, const T& little) {
  using detail::zero_where_less;
  using std::min;
  const LoweredLink<S>& link = model.link(k);
  const RoundingWeights<S>& w = model.body(k).weights;
  const auto& at = factors.links[k];
  Traces sum = pending_[k];
  const S unit = rounding_unit<S>();
  const T own = absorbed(w, z) + (w.moment * sum.turning + w.force * sum.moving);
  const T two = T(S(2));
  sum.turning += squares(z.x, z.y, z.z);
  sum.moving += squares(z.u, z.v, z.w);
  const T h = link.slides ? sum.moving : sum.turning;
  const T share = min(own, little) + zero_where_less(own, little, T(unit * at.inverse_D * h));
  if (link.parent < 0) return share;
  const Traces g = sizes(link, at.g);
  const T turning = two * (sum.turning + h * g.turning), moving = two * (sum.moving + h * g.moving);
  Traces& to = pending_[link.parent];
  to.turning += zero_where_less(own, little, T(two * turning + reach(model, factors, k) * moving));
  to.moving += zero_where_less(own, little, moving);
  return share;
}

// T of (4).
template <class T>
template <class Factors>
T ForceNoise<T>::trace(const LoweredModel<S>& model, const Factors& factors) {
  using std::min;
  const T two = T(S(2));
  T sum = T(S(0));
  for (int k = 0; k < model.nv(); ++k) {
    const LoweredLink<S>& link = model.link(k);
    const LoweredBody<S>& body = model.body(k);
    const auto& at = factors.links[k];
    Traces Omega = {T(S(0)), T(S(0))};
    if (link.parent >= 0) {
      Omega = responses_[link.parent];
      Omega.moving = two * Omega.moving + reach(model, factors, k) * Omega.turning;
    }
    const Traces g = sizes(link, at.g);
    T v = T(at.inverse_D) + two * (g.turning * Omega.turning + g.moving * Omega.moving);
    if (body.r > S(0)) v = min(v, T(S(1) / body.r));
    sum += v;
    Omega.turning = two * Omega.turning;
    Omega.moving = two * Omega.moving;
    (link.slides ? Omega.moving : Omega.turning) += two * v;
    const S unit = rounding_unit<S>();
    Omega.turning = min(Omega.turning, T(body.weights.moment / unit));
    Omega.moving = min(Omega.moving, T(body.weights.force / unit));
    responses_[k] = Omega;
  }
  return min(sum, T(constant_trace_));
}

}  // namespace kalmarm
