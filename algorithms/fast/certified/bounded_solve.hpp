// d = M^^-1 r by kept factors (columns.hpp), and how wrong it can be: for one state or one in every lane.
// M of factors whose D are right to eps is within 1 +- eps of M in the order of positive semidefinite
// matrices (rounding_test.hpp, rounding_bound.hpp), so that exact arithmetic on them gives d to eps |d|_M.
// With N, E and T of force_noise.hpp, |d|_M^2 <= E, and in Euclid's norm, in which an answer is judged,
//   |error of d|^2 <= T (eps^2 E + (c u)^2 (N + E))                                       (1)
// which is (8') there, of an error of D that is known.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/fast/factors/solve.hpp"

namespace kalmarm {

template <class T>
class BoundedSolve {
 public:
  using S = typename Lanes<T>::Scalar;

  explicit BoundedSolve(const LoweredModel<S>& model)
      : columns_(model),
        all_(model.nv(), 1),
        forces_(detail::forces_of<T>(model)),
        unit_(model.rounding_unit()),
        largest_variance_(model.largest_variance()) {}

  // d (nv) = M^^-1 r; a bound of (1) is returned.
  template <class Factors>
  T solve(const LoweredModel<S>& model, const Factors& factors, const T& eps, const T* r, T* d) {
    using std::min;
    const SolveSums<T> sums = detail::solve(
        model, factors, all_.data(), [&](int k) { return r[k]; }, columns_, forces_,
        [&](int k, const T& x) { d[k] = x; });
    const S cu = S(rounding_constant) * unit_roundoff<S>();
    return min(sums.trace, T(largest_variance_)) *
           (eps * eps * sums.energy + T(cu * cu) * (sums.noise / T(unit_) + sums.energy));
  }

 private:
  ColumnsWorkspace<T> columns_;
  std::vector<char> all_;  // links: a path for any r
  std::optional<ForceNoise<T>> forces_;
  S unit_, largest_variance_;
};

}  // namespace kalmarm
