// g and D of every link from q alone: the filter without velocities and forces, whose factors are
// kept for what follows (columns.hpp, lambda.hpp); limbs of a tree in lanes (limbs.hpp). About 195
// flops a hinge that is an heir, and its sine and cosine.
#pragma once

#include <vector>

#include "algorithms/structured/limbs.hpp"

namespace kalmarm {

template <class T>
struct StructuredFactors : Placements<T> {
  struct Link {
    T d;  // of a slide
    T inverse_D;
    Sixfold<T> g;
  };
  // What the children of a link with several have summed up to.
  struct Branch {
    bool begun;
    Articulated<T> P;
    Size<T> size;
  };

  std::vector<Link> links;
  std::vector<Branch> branches;
  T margin;  // least D - net x size
  Limbs<T> limbs;

  template <class S>
  explicit StructuredFactors(const StructuredModel<S>& model)
      : Placements<T>(model), links(model.nv()), branches(model.slots()), limbs(model) {}
};

namespace detail {

// The filter's rider where there is nothing to be carried.
template <class T, class S>
struct NoForces {
  struct Load {};

  const StructuredModel<S>& model;
  StructuredFactors<T>& factors;

  void begin_all() const { factors.limbs.factor(model, factors); }
  bool has_done(int k) const { return factors.limbs.have(k); }
  void begin(int, Load) const {}
  void add_body(int, Load) const {}
  void add_branch(int, Load) const {}
  void keep(int, bool, Load) const {}
  template <bool slides, bool noise, class P_plus>
  [[gnu::always_inline]] void measured(int k, const Sixfold<T>&, const T& inverse_D, const P_plus&,
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
void structured_factor(const StructuredModel<S>& model, const T* q, StructuredFactors<T>& factors) {
  detail::set_placements(model, q, factors);
  detail::filter<T>(model, factors, detail::NoForces<T, S>{model, factors});
}

}  // namespace kalmarm
