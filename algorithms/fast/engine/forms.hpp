// The forms of the fast path as types: which sweeps give accelerations and factors, and what takes a
// second look at a suspect (guard.hpp). What calls a kernel that is
// compiled once includes instances.hpp too; what counts flops (flops.hpp) must not: it is no part of
// the kernels, which a program for every instruction set keeps to themselves.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/fast/covariance/at_rest.hpp"
#include "algorithms/fast/covariance/forward_dynamics.hpp"
#include "algorithms/fast/covariance/rounding_bound.hpp"
#include "algorithms/fast/square_root/square_root.hpp"
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
  static constexpr Form form = Form::conventional;
  static constexpr bool at_rest = false;
  template <class T>
  using Workspace = CovarianceWorkspace<T>;

  template <class T, class S>
  static void acceleration(const LoweredModel<S>& model, const T* q, const T* qd, const T* tau,
                           Workspace<T>& ws, T* a) {
    covariance_acceleration(model, q, qd, tau, ws, a);
  }

  template <class T>
  static AccelerationSums<T> sums(const Workspace<T>& swept) {
    return {swept.noise, swept.energy, swept.squares, swept.size,
            swept.lost,  swept.loss,   swept.rounding};
  }

  // z-(k) of a sweep of one state, whose squares hold those of what its own bias cancels from.
  template <class S>
  static Sixfold<S> forces(const LoweredModel<S>& model, const Workspace<S>& swept, int k) {
    return with_bias(model.body(k), swept.links[k].wx, swept.links[k].wy, swept.links[k].wz,
                     swept.z[k]);
  }

  // Whether a D whose margin is positive may yet count in the error of an acceleration.
  template <class S>
  static bool may_lose_motion(const LoweredModel<S>& model) {
    return model.may_lose_motion();
  }

  // D and g at q alone.
  template <class S>
  struct Factoring {
    explicit Factoring(const LoweredModel<S>&) {}

    void factor(const LoweredModel<S>& model, const S* q, FastFactors<S>& factors) const {
      covariance_factor(model, q, factors);
    }
  };

  // A second look at a suspect.
  template <class S>
  struct SecondLook {
    RoundingBound<S> bound;

    explicit SecondLook(const LoweredModel<S>& model) : bound(model) {}

    // How wrong a D can be, relatively.
    template <class Swept>
    double error_of_D(const LoweredModel<S>& model, const S* q, const Swept&, int) {
      return bound.look(model, q).bound;
    }
  };
};

struct SquareRootForm {
  static constexpr Form form = Form::square_root;
  static constexpr bool at_rest = false;
  template <class T>
  using Workspace = SquareRootWorkspace<T>;

  template <class T, class S>
  static void acceleration(const LoweredModel<S>& model, const T* q, const T* qd, const T* tau,
                           Workspace<T>& ws, T* a) {
    square_root_acceleration(model, q, qd, tau, ws, a);
  }

  // Rows lose no D that their margin does not tell.
  template <class T>
  static AccelerationSums<T> sums(const Workspace<T>& swept) {
    const T none = swept.squares * T(typename Lanes<T>::Scalar(0));
    return {swept.noise, swept.energy, swept.squares, swept.size, none, none, swept.rounding};
  }

  template <class S>
  static const Sixfold<S>& forces(const LoweredModel<S>&, const Workspace<S>& swept, int k) {
    return swept.z[k];
  }

  // Rows lose about u^2 where P loses u.
  template <class S>
  static bool may_lose_motion(const LoweredModel<S>&) {
    return false;
  }

  template <class S>
  struct Factoring {
    SquareRootWorkspace<S> ws;
    std::vector<S> zeros;

    explicit Factoring(const LoweredModel<S>& model) : ws(model), zeros(model.nv(), S(0)) {}

    void factor(const LoweredModel<S>& model, const S* q, FastFactors<S>& factors) {
      square_root_factor(model, q, zeros, ws, factors);
    }
  };

  // The threshold is made of composite inertias, which grow with the cube of a chain's length: in
  // float32 it catches long chains. P of the other form tells them from singular ones, for less than
  // the certified form takes. The two have to agree on every D: rows of least weight would show there.
  template <class S>
  struct SecondLook {
    FastFactors<S> factors;
    RoundingBound<S> bound;

    explicit SecondLook(const LoweredModel<S>& model) : factors(model), bound(model) {}

    // How wrong a D can be, relatively. swept: where the rows have left 1 / D.
    template <class Swept>
    double error_of_D(const LoweredModel<S>& model, const S* q, const Swept& swept, int lane) {
      covariance_factor(model, q, factors);
      double error = factors.margin > S(0) ? 0 : bound.look(model, q).bound;
      for (int k = 0; k < model.nv(); ++k) {
        const S by_rows = detail::number(swept.links[k].inverse_D, lane);
        const double apart =
            std::abs(static_cast<double>(by_rows / factors.links[k].inverse_D) - 1);
        if (!(apart <= error)) error = apart;
      }
      return error;
    }
  };
};

// The covariance form where all velocities are zero: qd is not looked at.
struct AtRest : CovarianceForm {
  static constexpr bool at_rest = true;

  template <class T, class S>
  static void acceleration(const LoweredModel<S>& model, const T* q, const T*, const T* tau,
                           Workspace<T>& ws, T* a) {
    resting_acceleration(model, q, tau, ws, a);
  }

  template <class S>
  static const Sixfold<S>& forces(const LoweredModel<S>&, const Workspace<S>& swept, int k) {
    return swept.z[k];
  }
};

}  // namespace kalmarm
