// Guarded refinement of x by factors that are kept, for one state or one in every lane:
//   d(i)   = M^^-1 r(x(i))          r in twice the precision (residual.hpp), M^ as it was factored
//   x(i+1) = x(i) + d(i)            as a sum of two numbers, high + low, by (1) of pair.hpp
//   e(i)   = |d(i)| / |x(i+1)|      Euclid's norm
//   rho(0) = max(100 e(0), eps),  rho(i) = |d(i)| / |d(i-1)|   how far one step leaves its error  (1)
//   left(i) = e(i) rho(i)           of the error of x(i+1), relatively                         (2)
// A step is taken until left(i) <= u / 4 and rho(i) <= 0.3; where rho(i) is larger, i > 0, the
// factors do not help, and the caller takes better ones. In the end x is rounded to its high part:
//   |a - x| / |x| = |low| / |x| + left                                                    (3)
// of which the first term is known, not estimated. What the equation itself is wrong by, in twice the
// precision, is the caller's to add.
//
// The caller says how wrong d(i) can be, |error of d(i)|^2 <= bound(i) (bounded_solve.hpp), so that
//   |a - x(i+1)| <= sqrt(bound(i))                                                        (4)
// but for what rounding does to r in twice the precision. That has to be below trust |x(i+1)|,
// trust = trusted_error, else another step is taken, whose d is smaller.
//   |d(0)| <= far |x(i+1)|                                                                (5)
// since d(0) is what rounding did to x(0), and does to the high parts of the residual. In pairs, what
// cancels within a link keeps no more digits than double has (pair.hpp): far = 1e-9.
// In equilibrium a is zero: beside a gravity g, u g takes the place of a smaller |x| in (4), and 0.1 g
// in (5).
//
// eps is the error of M^ where that has been measured (probe.hpp), else 0.
// M^ is wrong by about rho in the directions that count, x(0) by e(0): the same factors made both.
// That rho(0) is at most 100 e(0) is a rule of experience, for factors whose every D is right to a
// digit: with a D that is noise, (3) was seen to be a thousandth of the error. Where e(0) is below
// sqrt(u) / 20 it saves the second residual, unless forces that cancel can have made d(0) wrong by
// more than u / 4 of x (the noise in its bound, which the rule does not know of): d(1) shows it.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "algorithms/fast/certified/residual.hpp"
#include "algorithms/fast/claims/constants.hpp"

namespace kalmarm {

// Of one state.
struct Verdict {
  bool settled = false;
  double error = std::numeric_limits<double>::quiet_NaN();  // (3)
  int steps = 0;
  double size = 0;  // |x| of (4), beside which what is added to `error` counts
};

template <class T>
class Refiner {
 public:
  using Model = typename TwiceResidual<T>::Model;
  static constexpr int lanes = Lanes<T>::count, most = 4;

  Refiner(int nv, double gravity) : gravity_(gravity), low_(nv), r_(nv), d_(nv) {}

  // x (nv) of the equation that `residual` has been set to; by.solve(r, d) writes d = M^^-1 r and
  // returns a bound of (4), by.closer(r) a closer one, by.noise() the part of either that is
  // noise. Of the lanes, the first `states` count. error_of_factors: eps of (1).
  template <class Kept>
  void refine(const Model& model, TwiceResidual<T>& residual, Kept&& by, int states, T* x,
              Verdict* out, double error_of_factors = 0);

 private:
  // Norms are sums of squares. Out of this range they may have lost what is compared.
  using Norm = T;
  static constexpr double range = 0x1p800;

  static double lane(const Norm& x, int i) {
    if constexpr (lanes == 1)
      return x;
    else
      return x[i];
  }

  static double square(double x) { return x * x; }

  // |x|^2, or what takes its place beside gravity.
  double size(double xx) const { return std::max(xx, square(unit_roundoff<double>() * gravity_)); }

  // (4) and (5), of squares.
  bool trusted(double xx, double bound, double first) const {
    return bound <= square(trusted_error) * size(xx) &&
           first <= square(farthest_start) * std::max(xx, square(gravity_share * gravity_));
  }

  // Whether the noise of d(0) is below what is left.
  bool is_little(double noise, double xx) const {
    return noise <= square(unit_roundoff<double>() / 4) * size(xx);
  }

  // left(0), of e(0)^2.
  static double left_by_first(double ratio, double eps) {
    return std::max(first_contraction * ratio, eps > 0 ? eps * std::sqrt(ratio) : 0);
  }

  // Whether the first step is enough in every lane: as it is in most.
  bool settles(const Norm& xx, const Norm& dd, const Norm& ratio, const Norm& bound,
               const Norm& noise, double eps, int states) const {
    bool out = true;
    for (int i = 0; i < states; ++i)
      out = out && left_by_first(lane(ratio, i), eps) <= unit_roundoff<double>() / 4 &&
            lane(xx, i) < range && lane(xx, i) > 1 / range &&
            trusted(lane(xx, i), lane(bound, i), lane(dd, i)) &&
            is_little(lane(noise, i), lane(xx, i));
    return out;
  }

  double gravity_;
  std::vector<T> low_, r_, d_;
};

template <class T>
template <class Kept>
void Refiner<T>::refine(const Model& model, TwiceResidual<T>& residual, Kept&& by, int states, T* x,
                        Verdict* out, double error_of_factors) {
  const double u = unit_roundoff<double>(), enough = u / 4;
  const int nv = model.nv();
  double first[lanes], before[lanes],
      left[lanes];  // squares, but for left: few of them need a root
  bool open[lanes];
  std::fill_n(open, states, true);
  std::fill_n(out, states, Verdict{});
  std::fill_n(low_.begin(), nv, T(0.0));
  for (int step = 0, count = states; count > 0 && step < most; ++step) {
    residual.of(model, x, step == 0 ? nullptr : low_.data(), r_.data());
    Norm bound = by.solve(r_.data(), d_.data()), noise = by.noise();
    Norm xx(0), dd(0);
    for (int k = 0; k < nv; ++k) {
      const T s = x[k] + d_[k], t = s - x[k];
      const Norm high = s, d = d_[k];
      xx += high * high;
      dd += d * d;
      low_[k] = low_[k] + ((x[k] - (s - t)) + (d_[k] - t));
      x[k] = s;
    }
    const Norm ratio = dd / xx;
    if (step == 0 && settles(xx, dd, ratio, bound, noise, error_of_factors, states)) {
      for (int i = 0; i < states; ++i) {
        left[i] = left_by_first(lane(ratio, i), error_of_factors);
        out[i] = {.settled = true, .steps = 1};
      }
      break;
    }
    bound = by.closer(r_.data());
    noise = by.noise();
    for (int i = 0; i < states; ++i) {
      if (!open[i]) continue;
      const double squares = lane(xx, i), change = lane(dd, i);
      const bool zero = change == 0;
      const bool comparable = (squares < range && squares > 1 / range) || (zero && squares == 0);
      const double e = zero ? 0 : lane(ratio, i);
      const double rho = step > 0
                             ? (zero ? 0 : change / before[i])
                             : std::max(square(first_contraction) * e, square(error_of_factors));
      if (step == 0) first[i] = change;
      before[i] = change;
      left[i] = std::sqrt(e * rho);
      out[i].steps = step + 1;
      out[i].settled = comparable && rho <= square(worst_contraction) && left[i] <= enough &&
                       trusted(squares, lane(bound, i), first[i]) &&
                       (step > 0 || is_little(lane(noise, i), squares));
      // 100 e is a guess: where it is too large the next step measures rho.
      open[i] = comparable && !out[i].settled && (step == 0 || rho <= square(worst_contraction));
      count -= !open[i];
    }
  }
  Norm xx(0), ll(0);
  for (int k = 0; k < nv; ++k) {
    const T s = x[k] + low_[k];
    const Norm rest = low_[k] - (s - x[k]), high = s;
    x[k] = s;
    xx += high * high;
    ll += rest * rest;
  }
  const Norm lost = ll / xx;
  for (int i = 0; i < states; ++i) {
    out[i].error = left[i] + (lane(ll, i) > 0 ? std::sqrt(lane(lost, i)) : 0);
    out[i].size = std::sqrt(size(lane(xx, i)));
  }
}

}  // namespace kalmarm
