// g and D of every link from q alone, or with contacts and loads: the filter without velocities and forces. Its factors are
// used by columns.hpp and lambda.hpp; limbs of a tree run in SIMD lanes (limbs.hpp). About 195
// flops an aligned hinge (lowered_model.hpp), and its sine and cosine.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/fast/covariance/added_loads.hpp"
#include "algorithms/fast/covariance/contacts.hpp"
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
  std::vector<std::vector<Sixfold<T>>> rows;  // of contacts, that meet at a link: as `branches`
  T noise;                                    // K of contacts.hpp

  template <class S>
  explicit FastFactors(const LoweredModel<S>& model)
      : Placements<T>(model), links(model.nv()), branches(model.branch_count()), limbs(model) {
    if (model.contacts().empty()) return;
    std::vector<std::size_t> most(model.branch_count(), ResistingRows<T>::most);
    for (const auto& frame : model.contacts()) ++most[model.link(frame.link).branch];
    for (int k = 0; k < model.nv(); ++k)
      if (const auto& link = model.link(k); link.parent >= 0 && !link.hangs_on_previous)
        most[model.link(link.parent).branch] += ResistingRows<T>::most;
    rows.resize(most.size());
    for (std::size_t i = 0; i < most.size(); ++i) rows[i].reserve(most[i]);
  }
};

namespace detail {

// Loads, and the limbs that are lanes.
template <class T, class S>
void begin_factors(const LoweredModel<S>& model, const Acting<T>& given, FastFactors<T>& factors) {
  add_loads(model, given, factors, [](std::size_t, int, const Load<T>&) {});
  factors.limbs.factor(model, factors);
}

// The filter's policy where nothing is propagated along with P.
template <class T, class S>
struct NoForces {
  struct Load {};

  const LoweredModel<S>& model;
  FastFactors<T>& factors;
  const Acting<T>& contacts;

  void begin_all() const { begin_factors(model, contacts, factors); }
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

// The same where P is P0 and rows of contacts go along with it.
template <class T, class S>
struct Resistance {
  using Load = ResistingRows<T>;

  const LoweredModel<S>& model;
  FastFactors<T>& factors;
  const Acting<T>& contacts;

  void begin_all() const {
    for (auto& rows : factors.rows) rows.clear();
    factors.noise = T(S(0));
    for_each_contact(model, factors, contacts, [this](int link, const Sixfold<T>& w) {
      factors.rows[model.link(link).branch].push_back(w);
      factors.noise += absorbed(model.body(link).weights, w);
    });
    begin_factors(model, contacts, factors);
  }
  bool has_done(int k) const { return factors.limbs.have(k); }
  void begin(int, Load& z) const { z.clear(); }
  void add_body(int, Load&) const {}
  void add_branch(int index, Load& z) const {
    for (const Sixfold<T>& row : factors.rows[index]) z.add(row);
    z.compress();
  }
  void keep(int index, const Load& z) const { z.add_to(factors.rows[index]); }
  template <bool slides, bool noise, class P_plus>
  KALMARM_INLINE void measured(int k, const Sixfold<T>&, const T& inverse_D, const P_plus&,
                               Load& z) const {
    auto& at = factors.links[k];
    at.inverse_D = inverse_D;
    if constexpr (!noise) (slides ? at.g.w : at.g.z) = T(1);
    if (z.any()) z.template measure<slides, noise>(at.g, at.inverse_D);
  }
  template <class C, class D>
  void to_parent(const LoweredLink<S>& link, const Direction<C>& joint, const D& d, Load& z) const {
    z.move([&](auto& w) { force_to_parent(model, link, joint, d, w); });
  }
  void to_parent(const MatrixPlacement<T>& phi, Load& z) const {
    z.move([&](auto& w) { force_to_parent(phi, w); });
  }
  void cycle(Load& z) const {
    z.move([](auto& w) { w = kalmarm::cycle(w); });
  }
};

}  // namespace detail

// The factors of M at q (nq), or of H.
template <class T, class S>
void covariance_factor(const LoweredModel<S>& model, const T* q, FastFactors<T>& factors,
                       const Acting<T>& contacts = {}) {
  detail::set_placements(model, q, factors);
  if (!contacts.forces)
    return detail::filter<T>(model, factors, detail::NoForces<T, S>{model, factors, contacts});
  detail::filter<T>(model, factors, detail::Resistance<T, S>{model, factors, contacts});
  using std::min;
  factors.margin = min(factors.margin, T(T(S(1)) - T(model.share_of_noise()) * factors.noise));
}

// eps of (2) of contacts.hpp, of factors that were made with them.
template <class S>
double error_of_contacts(const LoweredModel<S>& model, const FastFactors<S>& factors) {
  const double noise(factors.noise), unit(model.rounding_unit()), u(unit_roundoff<S>());
  return rounding_constant * u * std::sqrt(noise / unit);
}

}  // namespace kalmarm
