// M^-1 tau for one tau or many, by factors that are kept: (3.3), two sweeps (columns.hpp).
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

template <class S>
class FactorSolver {
 public:
  explicit FactorSolver(const LoweredModel<S>& model)
      : one_(model), few_(model), all_(model.nv(), 1), block_(model.nv()) {}

  // X (nv x m) = M^-1 T (nv x m). About 87 nv m flops. Returns 0 if all of it is finite, else NaN.
  S solve(const LoweredModel<S>& model, const FastFactors<S>& factors, int m, const S* T, S* X);

 private:
  using Few = WidePack<S>;
  static constexpr int few = Lanes<Few>::count;

  ColumnsWorkspace<S> one_;
  ColumnsWorkspace<Few> few_;
  std::vector<char> all_;   // links: a path for any tau
  std::vector<Few> block_;  // of right-hand sides
};

template <class S>
S FactorSolver<S>::solve(const LoweredModel<S>& model, const FastFactors<S>& factors, int m,
                         const S* T, S* X) {
  const int nv = model.nv();
  S check = S(0);
  if (m == 1) {
    detail::sweep_inward(
        model, factors, nv - 1, all_.data(), [&](int k) { return T[k]; }, one_);
    detail::sweep_outward(model, factors, nv - 1, one_, [&](int k, const S& a) {
      check += a * S(0);
      X[k] = a;
    });
    return check;
  }
  Few checks = Few(S(0));
  for (int first = 0; first < m; first += few) {
    const int count = std::min(few, m - first);
    const std::ptrdiff_t start = std::ptrdiff_t(first) * nv;
    to_lanes(T + start, nv, count, m - first, block_);
    detail::sweep_inward(
        model, factors, nv - 1, all_.data(), [&](int k) { return block_[k]; }, few_);
    detail::sweep_outward(model, factors, nv - 1, few_, [&](int k, const Few& a) {
      checks += a * Few(S(0));
      block_[k] = a;
    });
    from_lanes(block_, nv, count, X + start);
  }
  for (int i = 0; i < few; ++i) check += checks[i];
  return check;
}

}  // namespace kalmarm
