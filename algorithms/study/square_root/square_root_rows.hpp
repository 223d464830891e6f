// Weighted rows (alpha; beta | zeta), weight w, that stand for w (alpha'w' + beta'v' + zeta)^2, and
// the fast Givens step on two of them (Gentleman, 1973; no square root):
//
//   pivot p with entry 1 in the column and weight d, row r with entry x and weight w
//     D = d + w x^2,  g = w x / D,  f = d / D
//     r <- r - x p,     w <- w f                     entry 0
//     p <- p + g r,     d <- D                       entry 1; r the new one
//     p <- f p + g r                                 the stable form; r the old one
//   d p'p + w r'r is the same before and after.
// Entries that are known to be 0 or 1 have types of their own: terms with them vanish when they are
// compiled, and the pattern of a result follows from that of the rows.
#pragma once

#include "algorithms/fast/covariance/articulated.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

// A number that is known to be one.
struct One {
  friend One operator-(One, Zero) { return {}; }
  friend One operator*(One, One) { return {}; }
  friend Zero operator*(One, Zero) { return {}; }
  friend Zero operator*(Zero, One) { return {}; }
};
inline Zero operator-(Zero) { return {}; }
template <class T>
T operator*(const T& x, One) {
  return x;
}
template <class T>
T operator*(One, const T& x) {
  return x;
}

// Copied number by number: GCC 12 keeps in memory what is copied as a block.
template <class T, class X = T, class Y = T, class Z = T, class U = T, class V = T, class W = T>
struct Row {
  using Number = T;

  X x;  // alpha
  Y y;
  Z z;
  U u;  // beta
  V v;
  W w;
  T zeta, weight;

  Row() = default;
  KALMARM_INLINE Row(const X& x_, const Y& y_, const Z& z_, const U& u_, const V& v_, const W& w_,
                     const T& zeta_, const T& weight_)
      : x(x_), y(y_), z(z_), u(u_), v(v_), w(w_), zeta(zeta_), weight(weight_) {}
  KALMARM_INLINE Row(const Row& r) : Row(r.x, r.y, r.z, r.u, r.v, r.w, r.zeta, r.weight) {}
  KALMARM_INLINE Row& operator=(const Row& r) {
    x = r.x;
    y = r.y;
    z = r.z;
    u = r.u;
    v = r.v;
    w = r.w;
    zeta = r.zeta;
    weight = r.weight;
    return *this;
  }
};

// A row of a body's rotation: beta = 0.
template <class T>
using Spin = Row<T, T, T, T, Zero, Zero, Zero>;

template <class T, class X, class Y, class Z, class U, class V, class W>
KALMARM_INLINE Row<T, X, Y, Z, U, V, W> make_row(const X& x, const Y& y, const Z& z, const U& u,
                                                 const V& v, const W& w, const T& zeta,
                                                 const T& weight) {
  return {x, y, z, u, v, w, zeta, weight};
}

// In this order they are eliminated: a translation changes alpha alone, so that beta = 0 stays.
enum class Column { u, v, w, z, x, y };

template <Column c, class R>
KALMARM_INLINE const auto& entry(const R& row) {
  if constexpr (c == Column::u)
    return row.u;
  else if constexpr (c == Column::v)
    return row.v;
  else if constexpr (c == Column::w)
    return row.w;
  else if constexpr (c == Column::z)
    return row.z;
  else if constexpr (c == Column::x)
    return row.x;
  else
    return row.y;
}

template <bool first, class A, class B>
KALMARM_INLINE const auto& choose(const A& a, const B& b) {
  if constexpr (first)
    return a;
  else
    return b;
}

// r - x p of entry k.
template <Column c, Column k, class X, class P, class R>
KALMARM_INLINE auto below(const X& x, const P& p, const R& r) {
  if constexpr (k == c)
    return Zero{};
  else
    return entry<k>(r) - x * entry<k>(p);
}

// p + g r of entry k, with the new r, or f p + g r with the old one.
template <Column c, Column k, bool stable, class T, class P, class R>
KALMARM_INLINE auto above(const T& f, const T& g, const P& p, const R& r) {
  if constexpr (k == c)
    return One{};
  else if constexpr (stable)
    return f * entry<k>(p) + g * entry<k>(r);
  else
    return entry<k>(p) + g * entry<k>(r);
}

// In the place of a row: there is none.
struct None {};

// Is there a row, with an entry that is not known to be zero?
template <Column c, class R>
constexpr bool has_entry() {
  if constexpr (std::is_same_v<R, None>)
    return false;
  else
    return !std::is_same_v<std::decay_t<decltype(entry<c>(std::declval<R>()))>, Zero>;
}

// D behind the step on a row, from d before it.
template <Column c, class T, class R>
KALMARM_INLINE T weight_with(const T& d, const R& r) {
  if constexpr (has_entry<c, R>())
    return d + r.weight * entry<c>(r) * entry<c>(r);
  else
    return d;
}

template <class P, class A, class B, class C>
struct Eliminated {
  P pivot;
  A a;
  B b;
  C c;
};

template <class P, class R>
struct PivotAndRow {
  P pivot;
  R row;
};

// One step, with D known.
template <Column c, bool stable, class T, class P, class R>
KALMARM_INLINE auto step(const P& p, const R& r, const T& D, const T& inverse_D) {
  using enum Column;
  if constexpr (!has_entry<c, R>()) {
    return PivotAndRow<P, R>{p, r};
  } else {
    const auto x = entry<c>(r);
    const T g = r.weight * x * inverse_D, f = p.weight * inverse_D;
    const auto row = make_row<T>(below<c, Column::x>(x, p, r), below<c, y>(x, p, r),
                                 below<c, z>(x, p, r), below<c, u>(x, p, r), below<c, v>(x, p, r),
                                 below<c, w>(x, p, r), r.zeta - x * p.zeta, r.weight * f);
    const auto& other = choose<stable>(r, row);
    const auto pivot = make_row<T>(
        above<c, Column::x, stable>(f, g, p, other), above<c, y, stable>(f, g, p, other),
        above<c, z, stable>(f, g, p, other), above<c, u, stable>(f, g, p, other),
        above<c, v, stable>(f, g, p, other), above<c, w, stable>(f, g, p, other),
        stable ? T(f * p.zeta + g * r.zeta) : T(p.zeta + g * row.zeta), D);
    return PivotAndRow<std::decay_t<decltype(pivot)>, std::decay_t<decltype(row)>>{pivot, row};
  }
}

// The steps of a column. All D are known before the first step, so that no division waits for
// another's step.
template <Column column, bool stable = false, class P, class A, class B = None, class C = None>
KALMARM_INLINE auto eliminate(const P& p, const A& a, const B& b = {}, const C& c = {}) {
  using T = typename P::Number;
  const T Da = weight_with<column>(p.weight, a), Db = weight_with<column>(Da, b),
          Dc = weight_with<column>(Db, c);
  const T inverse_Da = reciprocal(Da), inverse_Db = reciprocal(Db), inverse_Dc = reciprocal(Dc);
  const auto at_a = step<column, stable>(p, a, Da, inverse_Da);
  const auto at_b = step<column, stable>(at_a.pivot, b, Db, inverse_Db);
  const auto at_c = step<column, stable>(at_b.pivot, c, Dc, inverse_Dc);
  return Eliminated<std::decay_t<decltype(at_c.pivot)>, std::decay_t<decltype(at_a.row)>,
                    std::decay_t<decltype(at_b.row)>, std::decay_t<decltype(at_c.row)>>{
      at_c.pivot, at_a.row, at_b.row, at_c.row};
}

// The row (y:1 | zeta), kept as a sum: nothing is left to eliminate behind it.
template <class T>
struct LastRow {
  T weight, moment;  // moment = weight zeta

  T zeta() const { return moment / weight; }
};

// P of a link: six rows that are triangular in the order of Column.
template <class L1, class L2, class L3, class Rz, class Rx, class Ry>
struct Triangle {
  L1 l1;
  L2 l2;
  L3 l3;
  Rz rz;
  Rx rx;
  Ry ry;
};

template <class L1, class L2, class L3, class Rz, class Rx, class Ry>
Triangle(L1, L2, L3, Rz, Rx, Ry) -> Triangle<L1, L2, L3, Rz, Rx, Ry>;

template <class T>
using FullTriangle = Triangle<Row<T, T, T, T, One, T, T>, Row<T, T, T, T, Zero, One, T>,
                              Row<T, T, T, T, Zero, Zero, One>, Row<T, T, T, One, Zero, Zero, Zero>,
                              Row<T, One, T, Zero, Zero, Zero, Zero>, LastRow<T>>;

// The row's part of ry: 5 flops.
template <class T, class R>
KALMARM_INLINE LastRow<T> close(const LastRow<T>& to, const R& r) {
  if constexpr (std::is_same_v<R, None>) {
    return {to.weight, to.moment};
  } else {
    const T wy = r.weight * r.y;
    return {to.weight + wy * r.y, to.moment + wy * r.zeta};
  }
}

// The rows and up to six more, s without beta: 17, 15, 13, 11, 9 flops a step and 5 for the last.
template <bool stable, class L1, class L2, class L3, class Rz, class Rx, class Ry, class S1,
          class S2, class S3, class A, class B, class C>
KALMARM_INLINE auto absorb(const Triangle<L1, L2, L3, Rz, Rx, Ry>& to, const S1& s1, const S2& s2,
                           const S3& s3, const A& a, const B& b, const C& c) {
  const auto u = eliminate<Column::u, stable>(to.l1, a, b, c);
  const auto v = eliminate<Column::v, stable>(to.l2, u.a, u.b, u.c);
  const auto w = eliminate<Column::w, stable>(to.l3, v.a, v.b, v.c);
  const auto spins_z = eliminate<Column::z, stable>(to.rz, s1, s2, s3);
  const auto z = eliminate<Column::z, stable>(spins_z.pivot, w.a, w.b, w.c);
  const auto spins_x = eliminate<Column::x, stable>(to.rx, spins_z.a, spins_z.b, spins_z.c);
  const auto x = eliminate<Column::x, stable>(spins_x.pivot, z.a, z.b, z.c);
  const Ry with_spins = close(close(close(to.ry, spins_x.a), spins_x.b), spins_x.c);
  const Ry ry = close(close(close(with_spins, x.a), x.b), x.c);
  return Triangle{u.pivot, v.pivot, w.pivot, z.pivot, x.pivot, ry};
}

namespace detail {

template <class To, class From>
KALMARM_INLINE To number_as(const From& x) {
  if constexpr (std::is_same_v<To, From>)
    return x;
  else if constexpr (std::is_same_v<From, Zero>)
    return To(0);
  else if constexpr (std::is_same_v<From, One>)
    return To(1);
  else
    return To{};  // of an entry that is known: Zero or One
}

}  // namespace detail

// The same row with fewer entries that are known.
template <class T, class X, class Y, class Z, class U, class V, class W, class R>
KALMARM_INLINE void widen(const R& from, Row<T, X, Y, Z, U, V, W>& to) {
  using detail::number_as;
  to = {number_as<X>(from.x),
        number_as<Y>(from.y),
        number_as<Z>(from.z),
        number_as<U>(from.u),
        number_as<V>(from.v),
        number_as<W>(from.w),
        from.zeta,
        from.weight};
}
template <class T, class L1, class L2, class L3, class Rz, class Rx, class Ry>
KALMARM_INLINE void widen(const Triangle<L1, L2, L3, Rz, Rx, Ry>& from, FullTriangle<T>& to) {
  widen(from.l1, to.l1);
  widen(from.l2, to.l2);
  widen(from.l3, to.l3);
  widen(from.rz, to.rz);
  widen(from.rx, to.rx);
  to.ry = from.ry;
}

}  // namespace kalmarm
