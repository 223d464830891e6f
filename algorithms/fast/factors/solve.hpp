// M^-1 tau for one tau or many, by factors that are kept: (3.3), two sweeps (columns.hpp), and what
// (8') of force_noise.hpp asks of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "algorithms/fast/covariance/force_noise.hpp"
#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

// Of x = M^-1 tau, one or one in every lane: N and E of force_noise.hpp, |x|^2, and T.
template <class T>
struct SolveSums {
  T noise, energy, squares;
  T trace = no_trace<T>();
};

namespace detail {

// What the sweeps show of one column, or one in every lane.
template <class T, class S, class Factors>
struct SolveObserver {
  const LoweredModel<S>& model;
  const Factors& factors;
  std::optional<ForceNoise<T>>& forces;
  SolveSums<T>& sums;

  KALMARM_INLINE void gathered(int k, const Sixfold<T>& z) const {
    sums.noise +=
        forces ? forces->charge(model, factors, k, z) : absorbed(model.body(k).weights, z);
  }
  void measured(int, const T&) const {}
  KALMARM_INLINE void moved(int k, const T& e, const Sixfold<T>& l) const {
    const auto& at = factors.links[k];
    sums.energy += motion_terms(model.link(k), at.g, e, l) * T(S(1) / at.inverse_D);
  }
};

// What solves need to know of rounding that depends on the state.
template <class T, class S>
std::optional<ForceNoise<T>> forces_of(const LoweredModel<S>& model) {
  std::optional<ForceNoise<T>> out;
  if (model.rounding_depends_on_state()) out.emplace(model);
  return out;
}

// write(k, x) of x = M^-1 tau. all: a path for any tau. forces: forces_of the model.
template <class T, class S, class Factors, class Tau, class Write>
KALMARM_INLINE SolveSums<T> solve(const LoweredModel<S>& model, const Factors& factors,
                                  const char* all, const Tau& tau, ColumnsWorkspace<T>& ws,
                                  std::optional<ForceNoise<T>>& forces, const Write& write) {
  SolveSums<T> sums = {T(S(0)), T(S(0)), T(S(0))};
  const SolveObserver<T, S, Factors> observer = {model, factors, forces, sums};
  if (forces) forces->begin();
  sweep_inward(model, factors, model.nv() - 1, all, tau, ws, observer);
  sweep_outward(
      model, factors, model.nv() - 1, ws,
      [&](int k, const T& x) {
        sums.squares += x * x;
        write(k, x);
      },
      observer);
  if (forces) sums.trace = forces->trace(model, factors);
  return sums;
}

}  // namespace detail

template <class S>
class FactorSolver {
  using Few = WidePack<S>;

 public:
  static constexpr int lanes = Lanes<Few>::count;

  explicit FactorSolver(const LoweredModel<S>& model)
      : one_(model),
        few_(model),
        forces_of_one_(detail::forces_of<S>(model)),
        forces_of_few_(detail::forces_of<Few>(model)),
        all_(model.nv(), 1),
        block_(model.nv()) {}

  // X (nv x m) = M^-1 T (nv x m) of m columns, at most `lanes`; column j is in lane j of what is
  // returned. left >= m: so many columns of T can be read. About 127 nv m flops. Factors: as in
  // columns.hpp.
  template <class Factors>
  SolveSums<Few> solve(const LoweredModel<S>& model, const Factors& factors, int m, int left,
                       const S* T, S* X) {
    const int nv = model.nv();
    if (m == 1) {
      const SolveSums<S> one = detail::solve(
          model, factors, all_.data(), [&](int k) { return T[k]; }, one_, forces_of_one_,
          [&](int k, const S& x) { X[k] = x; });
      return {Few(one.noise), Few(one.energy), Few(one.squares), Few(one.trace)};
    }
    to_lanes(T, nv, m, left, block_);
    const SolveSums<Few> sums = detail::solve(
        model, factors, all_.data(), [&](int k) { return block_[k]; }, few_, forces_of_few_,
        [&](int k, const Few& x) { block_[k] = x; });
    from_lanes(block_, nv, m, X);
    return sums;
  }

 private:
  ColumnsWorkspace<S> one_;
  ColumnsWorkspace<Few> few_;
  std::optional<ForceNoise<S>> forces_of_one_;
  std::optional<ForceNoise<Few>> forces_of_few_;
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
      : ws_(model), forces_(detail::forces_of<P>(model)), path_(model.nv()), x_(model.nv()) {}

  // x() = M^-1 tau (nv), one tau in every lane; tau may be x(). About 127 nv flops a lane. Factors: as
  // in columns.hpp.
  template <class Factors>
  SolveSums<P> solve(const LoweredModel<S>& model, const Factors& factors,
                     const std::vector<P>& tau) {
    std::fill(path_.begin(), path_.end(), char(1));
    return detail::solve(
        model, factors, path_.data(), [&](int k) { return tau[k]; }, ws_, forces_,
        [&](int k, const P& x) { x_[k] = x; });
  }

  // The same of one b (nv) for all lanes; less where b is zero outboard.
  template <class Factors>
  SolveSums<P> solve(const LoweredModel<S>& model, const Factors& factors, const S* b) {
    for (int k = model.nv() - 1; k >= 0; --k) path_[k] = b[k] != S(0);
    for (int k = model.nv() - 1; k >= 0; --k)
      if (path_[k] && model.link(k).parent >= 0) path_[model.link(k).parent] = 1;
    return detail::solve(
        model, factors, path_.data(), [&](int k) { return P(b[k]); }, ws_, forces_,
        [&](int k, const P& x) { x_[k] = x; });
  }

  const std::vector<P>& x() const { return x_; }
  std::vector<P>& x() { return x_; }

 private:
  ColumnsWorkspace<P> ws_;
  std::optional<ForceNoise<P>> forces_;
  std::vector<char> path_;  // links with a b outboard that is not 0
  std::vector<P> x_;
};

}  // namespace kalmarm
