// Loads of a call among the bodies of the filter: the sums over children of their links begin with M of theirs
// (kinematics/loads.hpp), and with the traces of its rounding, which bodies absorb as they do that of children
// (rounding_test.hpp). Weights, least inertias and T are the robot's own: inertia that is added makes every bound
// of them hold the more.
#pragma once

#include <cstddef>

#include "algorithms/fast/covariance/rounding_test.hpp"
#include "algorithms/fast/kinematics/loads.hpp"

namespace kalmarm::detail {

// seen(i, link, load) of every frame i that is loaded.
template <class T, class S, class Workspace, class Seen>
void add_loads(const LoweredModel<S>& model, const Acting<T>& acting, Workspace& ws,
               const Seen& seen) {
  for_each_load(model, acting, [&](std::size_t i, int link, const Load<T>& load) {
    auto& sum = ws.branches[model.link(link).branch];
    add_body(sum.P, load.body);
    sum.pending.add({load.moment, load.force});
    seen(i, link, load);
  });
}

}  // namespace kalmarm::detail
