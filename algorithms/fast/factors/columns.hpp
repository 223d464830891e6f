// M^-1 tau for as many tau as T has lanes, on factors of U: filter and smoother of filter.hpp
// without bias. Every lane is a column; D, g and phi are the same for all.
//
//   e = (tau - H z-) / D,  z-(parent) += phi z+              tips to base
//   a = e - g' l+,  l+ = phi' l-(parent)                     base to tips
// In a column of M^-1, tau is a unit vector: the first sweep visits the links on the path to the
// base alone, and the second one only has to go as far as the diagonal. About 43 flops a link and
// lane in each, at an aligned hinge (lowered_model.hpp).
#pragma once

#include <array>
#include <vector>

#include "algorithms/fast/factors/factors.hpp"
#include "algorithms/fast/factors/lower_triangle.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

template <class T>
struct ColumnsWorkspace {
  struct Branch {
    Sixfold<T> z, l;
  };

  std::vector<T> e;
  std::vector<Branch> branches;

  template <class S>
  explicit ColumnsWorkspace(const LoweredModel<S>& model)
      : e(model.nv()), branches(model.branch_count()) {}
};

// Of every chunk of columns (lower_triangle.hpp) the links between them and the base.
class ColumnPaths {
 public:
  template <class Lowered>
  ColumnPaths(const Lowered& model, int columns, int lanes) {
    for_each_chunk(columns, lanes, [&](int first, int count) {
      std::vector<char>& path = paths_.emplace_back(model.nv(), 0);
      for (int k = first + count - 1; k >= 0; --k) {
        if (k >= first) path[k] = 1;
        if (path[k] && model.link(k).parent >= 0) path[model.link(k).parent] = 1;
      }
    });
  }

  const char* operator[](int chunk) const { return paths_[chunk].data(); }

 private:
  std::vector<std::vector<char>> paths_;
};

namespace detail {

// 1 in lane i, if there is one.
template <class T>
struct Unit {
  static T lane(int i) { return T(i == 0 ? 1 : 0); }
};
template <class S, int n>
struct Unit<Pack<S, n>> {
  KALMARM_INLINE static Pack<S, n> lane(int i) {
    static constexpr auto one_among_zeros = [] {
      std::array<S, 2 * n + 1> numbers{};
      numbers[n] = S(1);
      return numbers;
    }();
    return Pack<S, n>::load(&one_among_zeros[n - (i < 0 ? -1 : i < n ? i : n)]);
  }
};

// What is worked out at once: n columns of one state, or, where T has a state in every lane, one of each.
template <class T, int n>
struct ColumnsOf {
  using Lane = Pack<T, n>;
  static constexpr int count = n;

  KALMARM_INLINE static Lane unit(int i) { return Unit<Lane>::lane(i); }  // 1 in column i
  KALMARM_INLINE static T column(const Lane& x, int i) { return x[i]; }
};
template <class S, int states, int n>
struct ColumnsOf<Pack<S, states>, n> {
  using Lane = Pack<S, states>;
  static constexpr int count = 1;

  KALMARM_INLINE static Lane unit(int i) { return Lane(S(i == 0)); }
  KALMARM_INLINE static const Lane& column(const Lane& x, int) { return x; }
};

// Number by number: gcc keeps in memory what is assigned as a whole.
template <class T>
KALMARM_INLINE void set_zero(Sixfold<T>& x) {
  x.x = x.y = x.z = x.u = x.v = x.w = T(0);
}
template <class T>
KALMARM_INLINE void assign(Sixfold<T>& to, const Sixfold<T>& from) {
  to.x = from.x;
  to.y = from.y;
  to.z = from.z;
  to.u = from.u;
  to.v = from.v;
  to.w = from.w;
}
template <class T>
KALMARM_INLINE void cycle(T& x, T& y, T& z) {
  const T first = x;
  x = z;
  z = y;
  y = first;
}

// phi z+, for several columns at once.
template <class T, class S, class U>
KALMARM_INLINE void force_to_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                    const Placements<U>& placed, const U& d, Sixfold<T>& z) {
  using Kind = typename LoweredLink<S>::Kind;
  switch (link.kind) {
    case Kind::screws:
      if (link.slides)
        force_to_parent(model, link, model.uncommon(link).turn, d, z);
      else
        force_to_parent(model, link, placed.direction(link), link.d, z);
      break;
    case Kind::matrix:
      force_to_parent(placed.matrices[link.varying], z);
      break;
    case Kind::cyclic:
      cycle(z.x, z.y, z.z);
      cycle(z.u, z.v, z.w);
      break;
  }
}

// z- becomes z+; e is returned. at: d, g and 1 / D of link k.
template <class T, class S, class Link>
KALMARM_INLINE T gain(const LoweredModel<S>& model, int k, const Link& at, const T& tau,
                      Sixfold<T>& z) {
  const LoweredLink<S>& link = model.link(k);
  const auto& none = at.inverse_D;
  if (!link.has_noise)
    return link.slides ? gain<true, false>(at.g, none, tau, z)
                       : gain<false, false>(at.g, none, tau, z);
  const auto kept = none * model.body(k).r;
  return link.slides ? gain<true, true>(at.g, kept, tau, z) : gain<false, true>(at.g, kept, tau, z);
}

// Factors: Placements<U> with links of (d, g, inverse_D), as FastFactors<U> is and what a sweep of
// forward dynamics has left in its CovarianceWorkspace<U>.

// Sees z- of every link, e before it is divided by D, and then e+ and l+.
struct Unobserved {
  template <class Z>
  void gathered(int, const Z&) const {}
  template <class T>
  void measured(int, const T&) const {}
  template <class T, class L>
  void moved(int, const T&, const L&) const {}
};

// e of the links up to `last`, of which those with visits[k] have a tau(k) outboard that is not 0.
template <class T, class S, class Factors, class Tau, class Observer = Unobserved>
void sweep_inward(const LoweredModel<S>& model, const Factors& factors, int last,
                  const char* visits, const Tau& tau, ColumnsWorkspace<T>& ws,
                  const Observer& observer = {}) {
  for (auto& branch : ws.branches) set_zero(branch.z);
  Sixfold<T> z;
  set_zero(z);
  bool carried = false;  // z comes from link k + 1
  for (int k = last; k >= 0; --k) {
    if (!visits[k]) {
      ws.e[k] = T(0);
      carried = false;
      continue;
    }
    const LoweredLink<S>& link = model.link(k);
    const auto& at = factors.links[k];
    if (!carried) set_zero(z);
    if (link.branch >= 0) add(z, ws.branches[link.branch].z);
    observer.gathered(k, z);
    const T e = gain(model, k, at, T(tau(k)), z);
    observer.measured(k, e);
    ws.e[k] = e * at.inverse_D;
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    force_to_parent(model, link, factors, at.d, z);
    if (!carried) add(ws.branches[model.link(link.parent).branch].z, z);
  }
}

// write(k, a) of the links up to `last`.
template <class T, class S, class Factors, class Write, class Observer = Unobserved>
KALMARM_INLINE void sweep_outward(const LoweredModel<S>& model, const Factors& factors, int last,
                                  ColumnsWorkspace<T>& ws, const Write& write,
                                  const Observer& observer = {}) {
  Sixfold<T> l;
  set_zero(l);
  for (int k = 0; k <= last; ++k) {
    const LoweredLink<S>& link = model.link(k);
    const auto& at = factors.links[k];
    if (link.parent < 0)
      set_zero(l);
    else if (!link.hangs_on_previous)
      assign(l, ws.branches[model.link(link.parent).branch].l);
    if (link.parent >= 0) motion_from_parent(model, link, factors, at.d, l);
    observer.moved(k, ws.e[k], l);
    write(k, smooth(link, at.g, ws.e[k], l));
    if (link.branch >= 0) assign(ws.branches[link.branch].l, l);
  }
}

}  // namespace detail

}  // namespace kalmarm
