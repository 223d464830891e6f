// The filter's factors of the mass matrix, M = (I + K) D (I + K*): D(k) and g(k) of every joint,
// from any covariance update. Tips to base:
//   P-(k) = M(k) + sum over children c of phi(k,c) P+(c) phi'(k,c)       (3.6)
//   D, g, P+ of k                                                        by Update: (3.6), (3.10)
// Contacts add d e e' to M(k) (contacts/contact_row.hpp): an update that takes them has
//   add_contact(row, ws)          P-(k) += d e e', between start and the first measure
// A D(k) that may be lost in rounding gets a second look by singularity.hpp.
#pragma once

#include <cassert>
#include <span>
#include <vector>

#include "algorithms/model/link_kinematics.hpp"
#include "algorithms/study/inverse_mass/singularity.hpp"
#include "algorithms/study/riccati/covariance_update.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

template <class T, CovarianceUpdate<T> Update_>
struct Factors : Gains<T> {
  using Update = Update_;

  typename Update::template Workspace<T> update;
  SingularityTest<T, Update::resolution> test;

  explicit Factors(const Model<T>& model)
      : Gains<T>(model, Update::exact_constraint), update(model), test(model) {}
};

// D and g of every joint, of M + J'DJ of the contacts. On failure the outcome names the joint, and ws is
// not to be used.
template <class T, class Update>
Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin,
               std::span<const ContactRow<T>> contacts, Factors<T, Update>& ws) {
  // What rounding can spoil: an update that keeps contacts apart has gains without them.
  constexpr bool apart = requires { ws.update.alone; };
  const auto tested = [&]() -> const Gains<T>& {
    if constexpr (apart)
      return ws.update.alone;
    else
      return ws;
  };
  if constexpr (apart)
    ws.test.begin({});
  else
    ws.test.begin(contacts);
  Update::start(model, kin, ws.update);
  if constexpr (requires { Update::add_contact(contacts[0], ws.update); })
    for (const ContactRow<T>& row : contacts) Update::add_contact(row, ws.update);
  else
    assert(contacts.empty());  // in world frames there are none
  for (int k = model.nv() - 1; k >= 0; --k) {
    ws.D[k] = Update::measure(model, k, ws.update, ws.g[k]);
    if (!ws.test.passes(model, kin, k, tested().D[k])) return ws.test.look(model, kin, k, tested());
    if (model.parent(k) >= 0) Update::propagate(model, kin, k, ws.update);
  }
  return ws.test.suspect() ? ws.test.look(model, kin, 0, tested()) : Outcome{};
}

// The same of M.
template <class T, class Update>
Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Factors<T, Update>& ws) {
  return factor(model, kin, std::span<const ContactRow<T>>(), ws);
}

}  // namespace kalmarm
