// Lambda(k) of the smoother on the fast path, the covariance of its l, from factors alone; with it
// the diagonal of M^-1, and the rows n(k) by which an entry of M^-1 is read off the filter's z.
//
//   Lambda+(k) = phi' Lambda-(parent) phi,  0 at the fixed base
//   y = Lambda+ g,  alpha = 1/D + g'y = M^-1(k,k),  n = y - alpha H'
//   Lambda-(k) = Lambda+ - H'y' - n H
//   M^-1(k,j) = n(k)' z-(k)     where tau is 0 but for tau(j) = 1 and j is outboard of k
// Lambda is held as P is (articulated.hpp), but with the linear part first: [A B; B' C] on (v, w).
// So v - p x w moves it as n + p x f moves P, with -p, and the kernels are the same. About 250
// flops an aligned hinge (lowered_model.hpp).
#pragma once

#include <vector>

#include "algorithms/fast/factors/factors.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class T>
struct LambdaWorkspace {
  std::vector<Sixfold<T>> n;
  std::vector<T> alpha;
  std::vector<Articulated<T>> branches;  // Lambda- of links with several children

  template <class S>
  explicit LambdaWorkspace(const LoweredModel<S>& model)
      : n(model.nv()), alpha(model.nv()), branches(model.branch_count()) {}
};

namespace detail {

template <class C>
KALMARM_INLINE Turn<C> reversed(const Turn<C>& by) {
  Turn<C> back = by;
  back.s = -back.s;
  back.cs = -back.cs;
  return back;
}

// phi' Lambda- phi across a screw.
template <class T, class S, class C, class D>
KALMARM_INLINE Articulated<T> from_parent(const LoweredModel<S>& model, const LoweredLink<S>& link,
                                          const Turn<C>& joint, const D& d, Articulated<T> L) {
  if (link.p[2] != S(0)) translate_z(S(-link.p[2]), L);
  if (link.p[1] != S(0)) translate_y(S(-link.p[1]), L);
  translate_x(S(-link.p[0]), L);
  if (link.turned) rotate_z(reversed(model.uncommon(link).theta), L);
  Articulated<T> out = rotate_x(reversed(link.alpha), L);
  rotate_z(reversed(joint), out);
  translate_z(D(-d), out);
  return out;
}

template <class T>
KALMARM_NOINLINE void from_parent(const MatrixPlacement<T>& phi, Articulated<T>& L) {
  translate_z(T(-phi.p[2]), L);
  translate_y(T(-phi.p[1]), L);
  translate_x(T(-phi.p[0]), L);
  Rotation<T> back;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) back.R[i][j] = phi.R.R[j][i];
  rotate(back, L);
}

// Lambda+ g: L stands with its halves exchanged.
template <class T>
KALMARM_INLINE Sixfold<T> lambda_times(const Articulated<T>& L, const Sixfold<T>& g) {
  const Sixfold<T> y = times(L, Sixfold<T>{g.u, g.v, g.w, g.x, g.y, g.z});
  return {y.u, y.v, y.w, y.x, y.y, y.z};
}

}  // namespace detail

// alpha and n of every link. Not in pairs: filter.hpp says why.
template <class T, class S>
KALMARM_SWEEP void fast_lambda(const LoweredModel<S>& model, const FastFactors<T>& factors,
                               LambdaWorkspace<T>& ws) {
  using Kind = typename LoweredLink<S>::Kind;
  Articulated<T> L;
  for (int k = 0; k < model.nv(); ++k) {
    const LoweredLink<S>& link = model.link(k);
    const auto& at = factors.links[k];
    if (link.parent < 0) {
      const T o = T(S(0));
      L = {o, o, o, o, o, o, o, o, o, o, o, o, o, o, o, o, o, o, o, o, o};
    } else {
      if (!link.hangs_on_previous) L = ws.branches[model.link(link.parent).branch];
      if (link.kind == Kind::cyclic) {
        L = cycle(cycle(L));
      } else if (link.kind == Kind::matrix) {
        Articulated<T> moved = L;  // L stays in registers
        detail::from_parent(factors.matrices[link.varying], moved);
        L = moved;
      } else if (link.slides) {
        L = detail::from_parent(model, link, model.uncommon(link).turn, at.d, L);
      } else {
        const Turn<T> joint(factors.cos[link.varying], factors.sin[link.varying]);
        L = detail::from_parent(model, link, joint, link.d, L);
      }
    }
    const Sixfold<T> g = at.g;
    Sixfold<T> y = detail::lambda_times(L, g);
    const T alpha =
        at.inverse_D + ((g.x * y.x + g.y * y.y + g.z * y.z) + (g.u * y.u + g.v * y.v + g.w * y.w));
    ws.alpha[k] = alpha;
    if (link.slides) {
      L.Axz -= y.u;
      L.Ayz -= y.v;
      L.Bzx -= y.x;
      L.Bzy -= y.y;
      L.Bzz -= y.z;
      L.Azz -= y.w;
      y.w -= alpha;
      L.Azz -= y.w;
    } else {
      L.Cxz -= y.x;
      L.Cyz -= y.y;
      L.Bxz -= y.u;
      L.Byz -= y.v;
      L.Bzz -= y.w;
      L.Czz -= y.z;
      y.z -= alpha;
      L.Czz -= y.z;
    }
    ws.n[k] = y;
    if (link.branch >= 0) ws.branches[link.branch] = L;
  }
}

}  // namespace kalmarm
