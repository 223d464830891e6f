// The contract of a covariance update: how P is carried from joint to joint, tips to base. In one
// inward sweep the filter calls start once, then for every joint measure and propagate.
//
// In link frames H(k) is a unit row and all updates do the same around their algebra; LinkFrames
// writes that once. Its kernel has
//   set(k, inertia, ws)           P-(k) = M(k)
//   update(k, H, r, ws, g) -> D   P-(k) is complete: g written, P- becomes P+. H: UnitRow, Vector6
//   add(k, parent, phi, ws)       P-(parent) += phi P+(k) phi'
// and serves other frames as well (in_world_frame.hpp).
#pragma once

#include <concepts>

#include "algorithms/model/link_kinematics.hpp"

namespace kalmarm {

template <class U, class T>
concept CovarianceUpdate = std::constructible_from < typename U::template Workspace<T>,
const Model<T>& > &&requires(const Model<T>& model, const LinkKinematics<T>& kin, int k,
                             typename U::template Workspace<T>& ws,
                             const typename U::template Workspace<T>& done, Vector6<T>& g,
                             const Vector6<T>& x) {
  { U::name() } -> std::convertible_to<std::string>;
  // D is known to u^resolution of what was subtracted to reach it (factors.hpp).
  { U::resolution } -> std::convertible_to<int>;
  // HP+ = 0 to the last bit where r = 0, so that H z+ = tau may be set instead of computed.
  { U::exact_constraint } -> std::convertible_to<bool>;
  // P-(k) = M(k) for every link.
  { U::start(model, kin, ws) } -> std::same_as<void>;
  // P-(k) is complete: D(k) is returned, g(k) written, P- becomes P+.
  { U::measure(model, k, ws, g) } -> std::same_as<T>;
  // P-(parent) += phi P+(k) phi'.
  { U::propagate(model, kin, k, ws) } -> std::same_as<void>;
  // P+(k) x.
  { U::P_plus_times(k, x, done) } -> std::same_as<Vector6<T>>;
};

template <class Kernel>
struct LinkFrames {
  template <class T, class Workspace>
  static void start(const Model<T>& model, const LinkKinematics<T>&, Workspace& ws) {
    for (int k = 0; k < model.nv(); ++k) Kernel::set(k, model.inertia(k), ws);
  }

  template <class T, class Workspace>
  static T measure(const Model<T>& model, int k, Workspace& ws, Vector6<T>& g) {
    const Joint<T>& joint = model.joint(k);
    return Kernel::update(k, UnitRow{joint.axis()}, joint.r, ws, g);
  }

  template <class T, class Workspace>
  static void propagate(const Model<T>& model, const LinkKinematics<T>& kin, int k, Workspace& ws) {
    Kernel::add(k, model.parent(k), kin.phi[k], ws);
  }
};

}  // namespace kalmarm
