// M^^-1 r by kept factors (columns.hpp), and how wrong it can be: for one state or one in every
// lane. Errors in the energy norm |x|_M^2 = x' M x, by the factors themselves:
//   |d|_M^2 = sum of e(k)^2 / D(k)                                                        (1)
// M of the factors is within 1 +- eps of M in the order of positive semidefinite matrices, where a
// sweep's D are right to eps = largest_error_of_D (rounding_test.hpp), so that exact arithmetic on
// them gives d to eps |d|_M. An error w of the force on link k acts on the robot as a force on that
// link, whose response has the energy
//   w' Omega(k) w <= w' M(k)^-1 w,    Omega(k) = J(k) M^-1 J(k)'                          (2)
// since the other links only add inertia: the body absorbs the error. Where a sweep makes |w(i)| <=
// c u |z(i)| of a number z(i) of z-(k), and the like for the turns and the translation to the
// parent, sum over i of w(i) z(i)^2, with the weights of rounding_weights.hpp, is (2) in units of
// (c u)^2. A body that cannot absorb (massless, a point, or light beside what passes through it)
// hands S = w w' on, of which the traces are known,
//   h = H S H',  energy h / D;   S+ <= 2 (S + h g g'),  S(parent) += phi S+ phi'          (3)
// Euclid's norm, in which an answer is judged, is the larger by at most the root of the trace:
//   |x|^2 <= T |x|_M^2,  T = trace M^-1 = sum over k of v(k),  v(k) = 1/D + g' Omega(parent) g
//   Omega(k) <= 2 (phi' Omega(parent) phi + H' H v(k)),  Omega(k) <= M(k)^-1,  v(k) <= 1/r(k)  (4)
// of whose blocks of turning and of moving the traces are carried, outward.
//   |error of d|^2 <= 2 T (eps^2 |d|_M^2 + (c u)^2 sum of (2) and (3))                    (5)
// c = rounding_constant: roundings do not conspire, as in rounding_bound.hpp. What rounding does to
// the motions of the outward sweep is below u |d|_M and is not counted beside eps.
//
// Most states are content with less, 15 flops a link: every body absorbs what it gets, by (2), and
// T is one number for all states of a robot. The DoF x of a joint are what the accelerations of its
// two bodies differ by, so that
//   sum over a joint of v(k) <= 2 trace (M(k)^-1 + phi' M(parent)^-1 phi)                  (6)
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "algorithms/fast/covariance/rounding_test.hpp"
#include "algorithms/fast/factors/columns.hpp"

namespace kalmarm {

template <class T>
class BoundedSolve {
 public:
  using S = typename Lanes<T>::Scalar;

  explicit BoundedSolve(const LoweredModel<S>& model)
      : columns_(model),
        all_(model.nv(), 1),
        pending_(model.nv()),
        responses_(model.nv()),
        constant_trace_(constant_trace(model)) {}

  // Both of the following, on factors.
  template <class Factors>
  struct Kept {
    BoundedSolve& by;
    const LoweredModel<S>& model;
    const Factors& factors;

    T solve(const T* r, T* d) const { return by.solve(model, factors, r, d); }
    T closer(const T* r) const { return by.closer(model, factors, r); }
  };
  template <class Factors>
  Kept<Factors> on(const LoweredModel<S>& model, const Factors& factors) {
    return {*this, model, factors};
  }

  // d (nv) = M^^-1 r; a bound of (5) by (6) is returned. NaN or infinite where it is beyond T.
  template <class Factors>
  T solve(const LoweredModel<S>& model, const Factors& factors, const T* r, T* d) {
    sweep(model, factors, r, Absorbing<Factors>{*this, model, factors});
    detail::sweep_outward(model, factors, model.nv() - 1, columns_,
                          [&](int k, const T& x) { d[k] = x; });
    return bound(T(constant_trace_));
  }

  // (5) by (3) and (4), of the same r.
  template <class Factors>
  T closer(const LoweredModel<S>& model, const Factors& factors, const T* r) {
    std::fill(pending_.begin(), pending_.end(), Traces{T(S(0)), T(S(0))});
    sweep(model, factors, r, Handing<Factors>{{*this, model, factors}});
    return bound(trace(model, factors));
  }

 private:
  struct Traces {
    T turning, moving;  // of moments and forces in (3)
  };

  static constexpr S square(S x) { return x * x; }
  static T squares(const T& x, const T& y, const T& z) { return x * x + y * y + z * z; }
  static S rounding() { return square(S(rounding_constant) * unit_roundoff<S>()); }

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

  // (2) in units of (c u)^2, of z- alone.
  static T absorbed(const RoundingWeights<S>& w, const T& xx, const T& yy, const T& zz, const T& uu,
                    const T& vv, const T& ww) {
    return (w.Axx * xx + w.Ayy * yy + w.Azz * zz) + (w.Cxx * uu + w.Cyy * vv + w.Czz * ww);
  }

  // What the inward sweep shows: (1), and (2) at least.
  template <class Factors>
  struct Absorbing {
    BoundedSolve& to;
    const LoweredModel<S>& model;
    const Factors& factors;

    KALMARM_INLINE void gathered(int k, const Sixfold<T>& z) const {
      to.noise_ += absorbed(model.body(k).weights, z.x * z.x, z.y * z.y, z.z * z.z, z.u * z.u,
                            z.v * z.v, z.w * z.w);
    }
    KALMARM_INLINE void measured(int k, const T& e) const {
      to.energy_ += e * e * T(factors.links[k].inverse_D);
    }
  };
  template <class Factors>
  struct Handing : Absorbing<Factors> {
    void gathered(int k, const Sixfold<T>& z) const {
      this->to.charge(this->model, this->factors, k, z);
    }
  };

  template <class Factors, class Observer>
  void sweep(const LoweredModel<S>& model, const Factors& factors, const T* r,
             const Observer& observer) {
    energy_ = noise_ = T(S(0));
    detail::sweep_inward(
        model, factors, model.nv() - 1, all_.data(), [&](int k) { return r[k]; }, columns_,
        observer);
  }

  // (5). The weights are in units of their own.
  T bound(const T& trace) const {
    const S unit = rounding() / rounding_unit<S>();
    return T(S(2)) * trace * (square(S(largest_error_of_D)) * energy_ + unit * noise_);
  }

  static double constant_trace(const LoweredModel<S>& model);

  template <class Factors>
  void charge(const LoweredModel<S>& model, const Factors& factors, int k, const Sixfold<T>& z);
  template <class Factors>
  T trace(const LoweredModel<S>& model, const Factors& factors);

  ColumnsWorkspace<T> columns_;
  std::vector<char> all_;          // links: a path for any r
  std::vector<Traces> pending_;    // S of (3), in units of (c u)^2
  std::vector<Traces> responses_;  // Omega of (4)
  S constant_trace_;
  T energy_, noise_;  // noise: in units of the weights
};

// T of (6).
template <class T>
double BoundedSolve<T>::constant_trace(const LoweredModel<S>& model) {
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
        sum += 2 * (link.slides ? of_moves : of_turns);
      else if (run.last - first < 5)
        sum += 2 * of_turns;
      else  // it is where its position says
        sum += link.parent < 0 ? 2 * (of_turns + of_moves) : detail::no_body;
    }
  return sum;
}

// (2) and (3) of link k.
template <class T>
template <class Factors>
void BoundedSolve<T>::charge(const LoweredModel<S>& model, const Factors& factors, int k,
                             const Sixfold<T>& z) {
  using detail::zero_where_less;
  using std::min;
  const LoweredLink<S>& link = model.link(k);
  const RoundingWeights<S>& w = model.body(k).weights;
  const auto& at = factors.links[k];
  Traces sum = pending_[k];
  const T xx = z.x * z.x, yy = z.y * z.y, zz = z.z * z.z;
  const T uu = z.u * z.u, vv = z.v * z.v, ww = z.w * z.w;
  const S unit = rounding_unit<S>();
  const T own =
      absorbed(w, xx, yy, zz, uu, vv, ww) + (w.moment * sum.turning + w.force * sum.moving);
  // A hundredth of the other term of (5).
  const T little = T(S(0.01) * square(S(largest_error_of_D)) * unit / rounding()) * energy_;
  const T two = T(S(2));
  sum.turning += xx + yy + zz;
  sum.moving += uu + vv + ww;
  const T h = link.slides ? sum.moving : sum.turning;
  noise_ += min(own, little) + zero_where_less(own, little, T(unit * at.inverse_D * h));
  if (link.parent < 0) return;
  const Traces g = sizes(link, at.g);
  const T turning = two * (sum.turning + h * g.turning), moving = two * (sum.moving + h * g.moving);
  Traces& to = pending_[link.parent];
  to.turning += zero_where_less(own, little, T(two * turning + reach(model, factors, k) * moving));
  to.moving += zero_where_less(own, little, moving);
}

// T of (4).
template <class T>
template <class Factors>
T BoundedSolve<T>::trace(const LoweredModel<S>& model, const Factors& factors) {
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
  return sum;
}

}  // namespace kalmarm
