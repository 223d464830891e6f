// The test of every sweep: can rounding have moved a D(k) by more than is accepted, the
// share of the tolerance that is LoweredModel::error_of_D?
//
// An error E of P-(k) is the exact P- of a mechanism whose body k is M(k) + E. So if every link
// absorbs its errors, |E(k)| <= e M(k) with e < 1 in the order of positive semidefinite matrices,
// then M of the mechanism, and every D, is right to a factor of 1 +- e, however many joints there
// are: D is the least kinetic energy of unit acceleration. That is asked link by link with the
// constant weights w of rounding_weights.hpp,
//   e(k) = c u (sum over i of w(i) P(i,i) + trace(S M^-1)) < error_of_D                  (1)
// A link that does not absorb (massless, a point, or light beside what it carries) hands its
// errors on to its parent as S, of which the traces of the moments and of the forces are known:
//   S+ = psi S psi' <= 2 (S + h g g'),  h = H S H',  psi = I - gH                         (2)
//   S(parent) += 2 (moment + |p|^2 force), force      phi S+ phi'
// and D has to stand above them by itself,
//   c u (h + N) < error_of_D D                                                           (3)
// A state that fails both (1) and (3) at some joint is left to the next rung: margin <= 0. Where (1)
// holds in all positions, w.tested is false, and
// nothing is computed (rounding_weights.hpp): in float64 of most robots and of chains of 1000 links.
#pragma once

#include "algorithms/fast/covariance/articulated.hpp"
#include "algorithms/fast/lowering/rounding_weights.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

// Traces of S in (2), in units of u c.
template <class T>
struct HandedOn {
  T moment, force;

  static HandedOn none() {
    const T zero = T(typename Lanes<T>::Scalar(0));
    return {zero, zero};
  }

  KALMARM_INLINE void add(const HandedOn& other) {
    moment += other.moment;
    force += other.force;
  }
  // phi S phi', reach: 2 |p|^2.
  template <class R>
  KALMARM_INLINE void move(const R& reach) {
    moment = T(typename Lanes<T>::Scalar(2)) * moment + reach * force;
  }
};

namespace detail {

template <class T>
T zero_where_less(const T& a, const T& b, const T& x) {
  return a < b ? T(0) : x;
}

// (1): e of P- alone, in units of what is accepted. slides: of a joint that does, d.
template <bool slides, class T, class S>
KALMARM_INLINE T absorbed(const RoundingWeights<S>& w, const Articulated<T>& P, const T& d) {
  T e = (w.Axx * P.Axx + w.Ayy * P.Ayy + w.Azz * P.Azz) +
        (w.Cxx * P.Cxx + w.Cyy * P.Cyy + w.Czz * P.Czz);
  if constexpr (slides) e += w.moment * (d * d * (P.Cxx + P.Cyy));
  return e;
}
template <class T, class S>
KALMARM_INLINE T absorbed(const RoundingWeights<S>& w, const HandedOn<T>& pending) {
  return w.moment * pending.moment + w.force * pending.force;
}

// (2), before P- of a joint on a screw becomes P+: of what is pending and of P-, where e is 1 or more, in
// units of what is let pass; else nothing is left. Returned: c u (h + N) of (3), likewise.
template <bool slides, class T, class S>
KALMARM_INLINE T hand_on(const RoundingWeights<S>& w, const T& e, const Articulated<T>& P,
                         const Sixfold<T>& g, HandedOn<T>& pending) {
  const T two = T(S(2)), most = T(S(1));
  const T moment = P.Axx + P.Ayy + P.Azz, force = P.Cxx + P.Cyy + P.Czz;
  T h = slides ? T(pending.force + P.Czz) : T(pending.moment + P.Azz + w.reach * force);
  h = zero_where_less(e, most, h);
  T of_moments = g.x * g.x + g.y * g.y, of_forces = g.u * g.u + g.v * g.v;
  if constexpr (slides)
    of_moments += g.z * g.z;
  else
    of_forces += g.w * g.w;
  const T left_moment = two * (pending.moment + moment + h * of_moments);
  const T left_force = two * (pending.force + force + h * of_forces);
  pending = {zero_where_less(e, most, left_moment), zero_where_less(e, most, left_force)};
  return T(w.unit) * h;
}

// (1) to (3), of a D.
template <bool slides, class T, class S>
KALMARM_INLINE void test_D(const RoundingWeights<S>& w, const T& own_e, const Articulated<T>& P,
                           const T& D, const Sixfold<T>& g, HandedOn<T>& pending, T& margin) {
  using std::min;
  const T e = own_e + absorbed(w, pending);
  margin = min(margin, T(D - hand_on<slides>(w, e, P, g, pending)));
}

}  // namespace detail

}  // namespace kalmarm
