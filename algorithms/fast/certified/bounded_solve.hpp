// M^^-1 r by kept factors (columns.hpp), and how wrong it can be: for one state or one in every
// lane. Errors in the energy norm |x|_M^2 = x' M x, by the factors themselves:
//   |d|_M^2 = sum of e(k)^2 / D(k)                                                        (1)
// M of the factors is within 1 +- eps of M in the order of positive semidefinite matrices, where a
// sweep's D are right to eps = error_of_D_to_refine (rounding_test.hpp), so that exact arithmetic on
// them gives d to eps |d|_M. With N and T of force_noise.hpp, in Euclid's norm, in which an answer is
// judged,
//   |error of d|^2 <= 2 T (eps^2 |d|_M^2 + (c u)^2 N)                                     (2)
// c = rounding_constant: roundings do not conspire, as in rounding_bound.hpp. What rounding does to
// the motions of the outward sweep is below u |d|_M and is not counted beside eps. Most states are
// content with N and T for all of a robot's states.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/fast/covariance/force_noise.hpp"
#include "algorithms/fast/factors/columns.hpp"

namespace kalmarm {

template <class T>
class BoundedSolve {
 public:
  using S = typename Lanes<T>::Scalar;

  explicit BoundedSolve(const LoweredModel<S>& model)
      : columns_(model),
        all_(model.nv(), 1),
        noise_(model),
        unit_(square(S(rounding_constant) * unit_roundoff<S>()) / model.rounding_unit()) {}

  // The following, on factors; noise(): the part of the last bound that N has, not eps.
  template <class Factors>
  struct Kept {
    BoundedSolve& by;
    const LoweredModel<S>& model;
    const Factors& factors;

    T solve(const T* r, T* d) const { return by.solve(model, factors, r, d); }
    T closer(const T* r) const { return by.closer(model, factors, r); }
    T noise() const { return by.of_noise_; }
  };
  template <class Factors>
  Kept<Factors> on(const LoweredModel<S>& model, const Factors& factors) {
    return {*this, model, factors};
  }

  // d (nv) = M^^-1 r; a bound of (2) by (2) and (6) of force_noise.hpp is returned. NaN or infinite
  // where it is beyond T.
  template <class Factors>
  T solve(const LoweredModel<S>& model, const Factors& factors, const T* r, T* d) {
    sweep(model, factors, r, Absorbing<Factors>{*this, model, factors});
    detail::sweep_outward(model, factors, model.nv() - 1, columns_,
                          [&](int k, const T& x) { d[k] = x; });
    return bound(T(noise_.largest_variance()));
  }

  // (2) by (3) and (4) of force_noise.hpp, of the same r.
  template <class Factors>
  T closer(const LoweredModel<S>& model, const Factors& factors, const T* r) {
    noise_.begin();
    sweep(model, factors, r, Handing<Factors>{{*this, model, factors}});
    return bound(noise_.trace(model, factors));
  }

 private:
  static constexpr S square(S x) { return x * x; }

  // What the inward sweep shows: (1), and N at least.
  template <class Factors>
  struct Absorbing {
    BoundedSolve& to;
    const LoweredModel<S>& model;
    const Factors& factors;

    KALMARM_INLINE void gathered(int k, const Sixfold<T>& z) const {
      to.sum_ += absorbed(model.body(k).weights, z);
    }
    KALMARM_INLINE void measured(int k, const T& e) const {
      to.energy_ += e * e * T(factors.links[k].inverse_D);
    }
  };
  template <class Factors>
  struct Handing : Absorbing<Factors> {
    void gathered(int k, const Sixfold<T>& z) const {
      BoundedSolve& to = this->to;
      // A hundredth of the other term of (2).
      const T little =
          T(S(little_share) * square(S(error_of_D_to_refine)) / to.unit()) * to.energy_;
      to.sum_ += to.noise_.charge(this->model, this->factors, k, z, little);
    }
  };

  template <class Factors, class Observer>
  void sweep(const LoweredModel<S>& model, const Factors& factors, const T* r,
             const Observer& observer) {
    energy_ = sum_ = T(S(0));
    detail::sweep_inward(
        model, factors, model.nv() - 1, all_.data(), [&](int k) { return r[k]; }, columns_,
        observer);
  }

  // (c u)^2, for N in units of its weights.
  const S& unit() const { return unit_; }

  // (2)
  T bound(const T& trace) {
    of_noise_ = T(S(2)) * trace * (T(unit()) * sum_);
    return T(S(2)) * trace * (T(square(S(error_of_D_to_refine))) * energy_) + of_noise_;
  }

  ColumnsWorkspace<T> columns_;
  std::vector<char> all_;  // links: a path for any r
  ForceNoise<T> noise_;
  S unit_;
  T energy_, sum_;  // of (1); N in units of the weights
  T of_noise_;      // N's part of the last bound
};

}  // namespace kalmarm
