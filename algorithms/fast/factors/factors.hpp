// g and D of every link from q alone: the filter without velocities and forces. Its factors are
// used by columns.hpp and lambda.hpp; limbs of a tree run in SIMD lanes (limbs.hpp). About 195
// flops an aligned hinge (lowered_model.hpp), and its sine and cosine.
#pragma once

#include <vector>

#include "algorithms/fast/factors/limbs.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

template <class T>
struct FastFactors : Placements<T> {
  struct Link {
    T d;  // of a slide
    T inverse_D;
    Sixfold<T> g;
  };
  // Of a link with several children: the sum over them.
  struct Branch {
    Articulated<T> P;
    HandedOn<T> pending;
  };

  std::vector<Link> links;
  std::vector<Branch> branches;
  T margin;  // rounding_test.hpp
  Limbs<T> limbs;

  template <class S>
  explicit FastFactors(const LoweredModel<S>& model)
      : Placements<T>(model), links(model.nv()), branches(model.branch_count()), limbs(model) {}
};

namespace detail {

// The filter's policy where nothing is propagated along with P.
template <class T, class S>
struct NoForces {
  struct Load {};

  const LoweredModel<S>& model;
  FastFactors<T>& factors;

  void begin_all() const { factors.limbs.factor(model, factors); }
  bool has_done(int k) const { return factors.limbs.have(k); }
  void begin(int, Load) const {}
  void add_body(int, Load) const {}
  void add_branch(int, Load) const {}
  void keep(int, Load) const {}
  template <bool slides, bool noise, class P_plus>
  KALMARM_INLINE void measured(int k, const Sixfold<T>&, const T& inverse_D, const P_plus&,
                               Load) const {
    auto& at = factors.links[k];
    at.inverse_D = inverse_D;
    if constexpr (!noise) (slides ? at.g.w : at.g.z) = T(1);
  }
  template <class Link, class C, class D>
  void to_parent(const Link&, const Direction<C>&, const D&, Load) const {}
  void to_parent(const MatrixPlacement<T>&, Load) const {}
  void cycle(Load) const {}
};

}  // namespace detail

// The factors at q (nq).
template <class T, class S>
void covariance_factor(const LoweredModel<S>& model, const T* q, FastFactors<T>& factors) {
  detail::set_placements(model, q, factors);
  detail::filter<T>(model, factors, detail::NoForces<T, S>{model, factors});
}

}  // namespace kalmarm
