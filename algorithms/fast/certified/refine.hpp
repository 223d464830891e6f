// Guarded refinement of x by factors that are kept, for one state or one in every lane:
//   d(i)   = M^^-1 r(x(i))          r in twice the precision (residual.hpp), M^ as it was factored
//   x(i+1) = x(i) + d(i)            as a sum of two numbers, high + low, by (1) of pair.hpp
// Each step comes with a bound of what it leaves, (1) of bounded_solve.hpp,
//   |x - x(i+1)| <= left(i) |x(i+1)|,  Euclid's norm                                      (1)
// but for what rounding does to r in twice the precision, which is the caller's to add. A step is taken until
// left(i) <= u / 4; factors that are right to eps make each eps times as large as the one before, but for T.
// In the end x is rounded to its high part:
//   error = |low| / |x| + left                                                            (2)
// of which the first term is known, not estimated.
//   |d(0)| <= e max(|x|, 0.01 g),  e = accepted_error(default_tolerance<double>)          (3)
// since d(0) is what rounding did to x(0), and does to the high parts of the residual: in pairs, what cancels
// within a link keeps no more digits than double has (pair.hpp). In equilibrium a is zero: beside a gravity
// g, u g takes the place of a smaller |x| in (1).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "algorithms/fast/certified/residual.hpp"
#include "algorithms/fast/claims/claims.hpp"

namespace kalmarm {

// Of two squares, of which both may be zero.
inline double root_of_ratio(double a, double b) { return a == 0 ? 0 : std::sqrt(a / b); }

// Of one state.
struct RefinedAnswer {
  bool settled = false;                                     // (3), and (2) is a number
  double error = std::numeric_limits<double>::quiet_NaN();  // (2)
  int steps = 0;
  double size = 0;  // |x| of (1), beside which what is added to `error` counts
};

template <class T>
class Refiner {
 public:
  using Model = typename TwiceResidual<T>::Model;
  static constexpr int lanes = Lanes<T>::count, most = 4;

  Refiner(int nv, double gravity) : gravity_(gravity), low_(nv), r_(nv), d_(nv) {}

  // x (nv) of the equation that `residual` has been set to; solve(r, d) writes d = M^^-1 r and returns a
  // bound of its squared error. Of the lanes, the first `states` count.
  template <class Solve>
  void refine(const Model& model, TwiceResidual<T>& residual, const Solve& solve, int states, T* x,
              RefinedAnswer* out);

 private:
  // Norms are sums of squares. Out of this range they may have lost what is compared.
  static constexpr double range = 0x1p800;

  static double lane(const T& x, int i) {
    if constexpr (lanes == 1)
      return x;
    else
      return x[i];
  }

  static double square(double x) { return x * x; }

  // |x|^2, or what takes its place beside gravity.
  double size(double xx) const { return std::max(xx, square(unit_roundoff<double>() * gravity_)); }

  bool settles(double xx, double first, double error) const {
    const bool comparable = (xx < range && xx > 1 / range) || (xx == 0 && first == 0);
    const double beside = std::max(xx, square(least_beside_gravity * gravity_));
    return comparable && std::isfinite(error) &&
           first <= square(accepted_error(default_tolerance<double>)) * beside;
  }

  double gravity_;
  std::vector<T> low_, r_, d_;
};

template <class T>
template <class Solve>
void Refiner<T>::refine(const Model& model, TwiceResidual<T>& residual, const Solve& solve,
                        int states, T* x, RefinedAnswer* out) {
  const int nv = model.nv();
  T first(0.0);
  double left[lanes];
  bool open[lanes];
  std::fill_n(open, states, true);
  std::fill_n(out, states, RefinedAnswer{});
  std::fill_n(low_.begin(), nv, T(0.0));
  for (int step = 0, count = states; count > 0 && step < most; ++step) {
    residual.of(model, x, step == 0 ? nullptr : low_.data(), r_.data());
    const T bound = solve(r_.data(), d_.data());
    T xx(0.0), dd(0.0);
    for (int k = 0; k < nv; ++k) {
      const T s = x[k] + d_[k], t = s - x[k];
      xx += s * s;
      dd += d_[k] * d_[k];
      low_[k] = low_[k] + ((x[k] - (s - t)) + (d_[k] - t));
      x[k] = s;
    }
    if (step == 0) first = dd;
    for (int i = 0; i < states; ++i) {
      if (!open[i]) continue;
      left[i] = root_of_ratio(lane(bound, i), size(lane(xx, i)));
      out[i].steps = step + 1;
      // NaN, or what no step changes, is not followed.
      open[i] = left[i] > unit_roundoff<double>() / 4;
      count -= !open[i];
    }
  }
  T xx(0.0), ll(0.0);
  for (int k = 0; k < nv; ++k) {
    const T s = x[k] + low_[k];
    const T rest = low_[k] - (s - x[k]);
    x[k] = s;
    xx += s * s;
    ll += rest * rest;
  }
  for (int i = 0; i < states; ++i) {
    out[i].error = left[i] + root_of_ratio(lane(ll, i), lane(xx, i));
    out[i].size = std::sqrt(size(lane(xx, i)));
    out[i].settled = settles(lane(xx, i), lane(first, i), out[i].error);
  }
}

}  // namespace kalmarm
