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

#include "algorithms/structured/articulated.hpp"

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

// GCC 12 keeps in memory what is copied as a block: rows are copied number by number, packs as
// vectors.
template <class X>
[[gnu::always_inline]] inline X copy(const X& x) {
  return x;
}
template <class S, int n>
[[gnu::always_inline]] inline Pack<S, n> copy(const Pack<S, n>& x) {
  return Pack<S, n>::of(x.v);
}

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
  [[gnu::always_inline]] Row(const X& x_, const Y& y_, const Z& z_, const U& u_, const V& v_,
                             const W& w_, const T& zeta_, const T& weight_)
      : x(copy(x_)),
        y(copy(y_)),
        z(copy(z_)),
        u(copy(u_)),
        v(copy(v_)),
        w(copy(w_)),
        zeta(copy(zeta_)),
        weight(copy(weight_)) {}
  [[gnu::always_inline]] Row(const Row& r) : Row(r.x, r.y, r.z, r.u, r.v, r.w, r.zeta, r.weight) {}
  [[gnu::always_inline]] Row& operator=(const Row& r) {
    x = copy(r.x);
    y = copy(r.y);
    z = copy(r.z);
    u = copy(r.u);
    v = copy(r.v);
    w = copy(r.w);
    zeta = copy(r.zeta);
    weight = copy(r.weight);
    return *this;
  }
};

// A row of a body's rotation: beta = 0.
template <class T>
using Spin = Row<T, T, T, T, Zero, Zero, Zero>;

template <class T, class X, class Y, class Z, class U, class V, class W>
[[gnu::always_inline]] inline Row<T, X, Y, Z, U, V, W> make_row(const X& x, const Y& y, const Z& z,
                                                                const U& u, const V& v, const W& w,
                                                                const T& zeta, const T& weight) {
  return {x, y, z, u, v, w, zeta, weight};
}

// In this order they are eliminated: a translation changes alpha alone, so that beta = 0 stays.
enum class Column { u, v, w, z, x, y };

template <Column c, class R>
[[gnu::always_inline]] inline const auto& entry(const R& row) {
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

template <class P, class R>
struct Pair {
  P pivot;
  R row;
};

template <bool first, class A, class B>
[[gnu::always_inline]] inline const auto& choose(const A& a, const B& b) {
  if constexpr (first)
    return a;
  else
    return b;
}

// r - x p of entry k.
template <Column c, Column k, class X, class P, class R>
[[gnu::always_inline]] inline auto below(const X& x, const P& p, const R& r) {
  if constexpr (k == c)
    return Zero{};
  else
    return entry<k>(r) - x * entry<k>(p);
}

// p + g r of entry k, with the new r, or f p + g r with the old one.
template <Column c, Column k, bool stable, class T, class P, class R>
[[gnu::always_inline]] inline auto above(const T& f, const T& g, const P& p, const R& r) {
  if constexpr (k == c)
    return One{};
  else if constexpr (stable)
    return f * entry<k>(p) + g * entry<k>(r);
  else
    return entry<k>(p) + g * entry<k>(r);
}

template <Column c, bool stable = false, class P, class R>
[[gnu::always_inline]] inline auto eliminate(const P& p, const R& r) {
  using T = typename P::Number;
  using enum Column;
  const auto& e = entry<c>(r);
  if constexpr (std::is_same_v<std::decay_t<decltype(e)>, Zero>) {
    return Pair<P, R>{p, r};
  } else {
    const auto x = e;
    const T wx = r.weight * x, D = p.weight + wx * x, inverse_D = T(1) / D;
    const T g = wx * inverse_D, f = p.weight * inverse_D;
    const auto row = make_row<T>(below<c, Column::x>(x, p, r), below<c, y>(x, p, r),
                                 below<c, z>(x, p, r), below<c, u>(x, p, r), below<c, v>(x, p, r),
                                 below<c, w>(x, p, r), r.zeta - x * p.zeta, r.weight * f);
    const auto& other = choose<stable>(r, row);
    const auto pivot = make_row<T>(
        above<c, Column::x, stable>(f, g, p, other), above<c, y, stable>(f, g, p, other),
        above<c, z, stable>(f, g, p, other), above<c, u, stable>(f, g, p, other),
        above<c, v, stable>(f, g, p, other), above<c, w, stable>(f, g, p, other),
        stable ? T(f * p.zeta + g * r.zeta) : T(p.zeta + g * row.zeta), D);
    return Pair<std::decay_t<decltype(pivot)>, std::decay_t<decltype(row)>>{pivot, row};
  }
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

// The rows and one more, at most 6 steps: 17, 15, 13, 11, 9 flops and 5 for the last.
template <class L1, class L2, class L3, class Rz, class Rx, class Ry, class R>
[[gnu::always_inline]] inline auto absorb(const Triangle<L1, L2, L3, Rz, Rx, Ry>& to, const R& r) {
  const auto u = eliminate<Column::u>(to.l1, r);
  const auto v = eliminate<Column::v>(to.l2, u.row);
  const auto w = eliminate<Column::w>(to.l3, v.row);
  const auto z = eliminate<Column::z>(to.rz, w.row);
  const auto x = eliminate<Column::x>(to.rx, z.row);
  const auto wy = x.row.weight * x.row.y;
  const Ry last{to.ry.weight + wy * x.row.y, to.ry.moment + wy * x.row.zeta};
  return Triangle{u.pivot, v.pivot, w.pivot, z.pivot, x.pivot, last};
}

namespace detail {

template <class To, class From>
[[gnu::always_inline]] inline To number_as(const From& x) {
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
[[gnu::always_inline]] inline void widen(const R& from, Row<T, X, Y, Z, U, V, W>& to) {
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
[[gnu::always_inline]] inline void widen(const Triangle<L1, L2, L3, Rz, Rx, Ry>& from,
                                         FullTriangle<T>& to) {
  widen(from.l1, to.l1);
  widen(from.l2, to.l2);
  widen(from.l3, to.l3);
  widen(from.rz, to.rz);
  widen(from.rx, to.rx);
  to.ry = from.ry;
}

}  // namespace kalmarm
