// The sweeps of the fast path that give accelerations, as types. What calls a kernel that is
// compiled once includes instances.hpp too; what counts flops (flops.hpp) must not: it is no part of
// the kernels, which a program for every instruction set keeps to themselves.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/fast/covariance/at_rest.hpp"
#include "algorithms/fast/covariance/forward_dynamics.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {

namespace detail {

template <class S>
S number(const S& x, int) {
  return x;
}
template <class S, int n>
S number(const Pack<S, n>& x, int lane) {
  return x[lane];
}

}  // namespace detail

struct CovarianceForm {
  static constexpr bool at_rest = false;
  template <class T>
  using Workspace = CovarianceWorkspace<T>;

  template <class T, class S>
  static void acceleration(const LoweredModel<S>& model, const T* q, const T* qd, const T* tau,
                           Workspace<T>& ws, T* a, const Acting<T>& acting = {}) {
    covariance_acceleration(model, q, qd, tau, ws, a, acting);
  }

  template <class T>
  static AccelerationSums<T> sums(const Workspace<T>& swept) {
    AccelerationSums<T> out = {swept.noise, swept.energy, swept.squares, swept.size,
                               swept.rounding};
    if (swept.forces) out.trace = swept.trace;
    return out;
  }
};

// The covariance form where all velocities are zero: qd is not looked at.
struct AtRest : CovarianceForm {
  static constexpr bool at_rest = true;

  template <class T, class S>
  static void acceleration(const LoweredModel<S>& model, const T* q, const T*, const T* tau,
                           Workspace<T>& ws, T* a, const Acting<T>& acting = {}) {
    resting_acceleration(model, q, tau, ws, a, acting);
  }
};

}  // namespace kalmarm
