// M^-1 tau for one tau or many, by factors that are kept: (3.3), two sweeps (columns.hpp), and what
// (8') of force_noise.hpp asks of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "algorithms/fast/covariance/force_noise.hpp"
#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

// Of x = M^-1 tau, one or one in every lane: N and E of force_noise.hpp, and |x|^2.
template <class T>
struct SolveSums {
  T noise, energy, squares;
};

namespace detail {

// What the sweeps show of one column, or one in every lane.
template <class T, class S, class Factors>
struct SolveObserver {
  const LoweredModel<S>& model;
  const Factors& factors;
  SolveSums<T>& sums;

  KALMARM_INLINE void gathered(int k, const Sixfold<T>& z) const {
    sums.noise += absorbed(model.body(k).weights, z);
  }
  void measured(int, const T&) const {}
  KALMARM_INLINE void moved(int k, const T& e, const Sixfold<T>& l) const {
    const auto& at = factors.links[k];
    sums.energy += motion_terms(model.link(k), at.g, e, l) * T(S(1) / at.inverse_D);
  }
};

// write(k, x) of x = M^-1 tau. all: a path for any tau.
template <class T, class S, class Factors, class Tau, class Write>
KALMARM_INLINE SolveSums<T> solve(const LoweredModel<S>& model, const Factors& factors,
                                  const char* all, const Tau& tau, ColumnsWorkspace<T>& ws,
                                  const Write& write) {
  SolveSums<T> sums = {T(S(0)), T(S(0)), T(S(0))};
  const SolveObserver<T, S, Factors> observer = {model, factors, sums};
  sweep_inward(model, factors, model.nv() - 1, all, tau, ws, observer);
  sweep_outward(
      model, factors, model.nv() - 1, ws,
      [&](int k, const T& x) {
        sums.squares += x * x;
        write(k, x);
      },
      observer);
  return sums;
}

}  // namespace detail

template <class S>
class FactorSolver {
  using Few = WidePack<S>;

 public:
  static constexpr int lanes = Lanes<Few>::count;

  explicit FactorSolver(const LoweredModel<S>& model)
      : one_(model), few_(model), all_(model.nv(), 1), block_(model.nv()) {}

  // X (nv x m) = M^-1 T (nv x m) of m columns, at most `lanes`; column j is in lane j of what is
  // returned. left >= m: so many columns of T can be read. About 127 nv m flops. Factors: as in
  // columns.hpp.
  template <class Factors>
  SolveSums<Few> solve(const LoweredModel<S>& model, const Factors& factors, int m, int left,
                       const S* T, S* X) {
    const int nv = model.nv();
    if (m == 1) {
      const SolveSums<S> one = detail::solve(
          model, factors, all_.data(), [&](int k) { return T[k]; }, one_,
          [&](int k, const S& x) { X[k] = x; });
      return {Few(one.noise), Few(one.energy), Few(one.squares)};
    }
    to_lanes(T, nv, m, left, block_);
    const SolveSums<Few> sums = detail::solve(
        model, factors, all_.data(), [&](int k) { return block_[k]; }, few_,
        [&](int k, const Few& x) { block_[k] = x; });
    from_lanes(block_, nv, m, X);
    return sums;
  }

 private:
  ColumnsWorkspace<S> one_;
  ColumnsWorkspace<Few> few_;
  std::vector<char> all_;   // links: a path for any tau
  std::vector<Few> block_;  // of columns
};

// M^-1 tau of one state in every lane of P, by its factors or by what a sweep of forward dynamics has
// left.
template <class P>
class RowSolver {
  using S = typename Lanes<P>::Scalar;

 public:
  explicit RowSolver(const LoweredModel<S>& model)
      : ws_(model), path_(model.nv()), x_(model.nv()) {}

  // x() = M^-1 tau (nv), one tau in every lane; tau may be x(). About 127 nv flops a lane. Factors: as
  // in columns.hpp.
  template <class Factors>
  SolveSums<P> solve(const LoweredModel<S>& model, const Factors& factors,
                     const std::vector<P>& tau) {
    std::fill(path_.begin(), path_.end(), char(1));
    return detail::solve(
        model, factors, path_.data(), [&](int k) { return tau[k]; }, ws_,
        [&](int k, const P& x) { x_[k] = x; });
  }

  // The same of one b (nv) for all lanes; less where b is zero outboard.
  template <class Factors>
  SolveSums<P> solve(const LoweredModel<S>& model, const Factors& factors, const S* b) {
    for (int k = model.nv() - 1; k >= 0; --k) path_[k] = b[k] != S(0);
    for (int k = model.nv() - 1; k >= 0; --k)
      if (path_[k] && model.link(k).parent >= 0) path_[model.link(k).parent] = 1;
    return detail::solve(
        model, factors, path_.data(), [&](int k) { return P(b[k]); }, ws_,
        [&](int k, const P& x) { x_[k] = x; });
  }

  const std::vector<P>& x() const { return x_; }
  std::vector<P>& x() { return x_; }

 private:
  ColumnsWorkspace<P> ws_;
  std::vector<char> path_;  // links with a b outboard that is not 0
  std::vector<P> x_;
};

}  // namespace kalmarm
