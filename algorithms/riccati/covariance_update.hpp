// The contract of a covariance update: how P is carried from joint to joint, tips to base. In one
// inward sweep the filter calls start once, then for every joint measure and propagate.
#pragma once

#include <concepts>

#include "algorithms/model/random_model.hpp"

namespace kalmarm {

template <class U, class T>
concept CovarianceUpdate = std::constructible_from < typename U::template Workspace<T>,
const Model<T>& > &&requires(const Model<T>& model, int k, typename U::template Workspace<T>& ws,
                             const typename U::template Workspace<T>& done, Vector6<T>& g,
                             const Vector6<T>& x, const Transform<T>& phi) {
  { U::name } -> std::convertible_to<const char*>;
  // D is known to u^resolution of what was subtracted to reach it (factors.hpp).
  { U::resolution } -> std::convertible_to<int>;
  // HP+ = 0 to the last bit where r = 0, so that H z+ = tau may be set instead of computed.
  { U::exact_constraint } -> std::convertible_to<bool>;
  // P-(k) = M(k) for every link.
  { U::start(model, ws) } -> std::same_as<void>;
  // P-(k) is complete: D(k) is returned, g(k) written, P- becomes P+.
  { U::measure(model, k, ws, g) } -> std::same_as<T>;
  // P-(parent) += phi P+(k) phi'.
  { U::propagate(model, k, phi, ws) } -> std::same_as<void>;
  // P+(k) x.
  { U::template P_plus_times<T>(k, x, done) } -> std::same_as<Vector6<T>>;
};

}  // namespace kalmarm
