// Energies |x|_M^2 = x' M x by factors M = (I + K) D (I + K*) that are kept: of a vector, for one state or one in
// every lane, and of M^-1 r, which is solved for.
//   y = (I + K*) x,  |x|_M^2 = sum of D(k) y(k)^2:  y(k) = x(k) + g' l+(k),  l- = l+ + H' x     (1)
//   |M^-1 r|_M^2 = r' M^-1 r = sum of D(k) e+(k)^2,  e+ of M^-1 r (columns.hpp)                 (2)
// Either sum has no negative term. What rounding and an error eps of every D do to them, by (2) and (7) of
// force_noise.hpp, of (1) without N:
//   |error|_M^2 <= (c u)^2 (N + E) + eps^2 E                                                    (3)
// Factors: as in columns.hpp. (1) takes about 55 flops a link, (2) is a solve, 129.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "algorithms/fast/factors/solve.hpp"

namespace kalmarm {

// Of a vector x.
template <class T>
struct EnergySums {
  T size;           // |x|_M^2
  T squares;        // |x|^2
  T noise, energy;  // N and E
  T trace = no_trace<T>();
};

namespace detail {

// What sweep_outward shows of M^-1 r, and (2).
template <class T, class S, class Factors>
struct EnergyObserver : SolveObserver<T, S, Factors> {
  T& size;

  KALMARM_INLINE void moved(int k, const T& e, const Sixfold<T>& l) const {
    SolveObserver<T, S, Factors>::moved(k, e, l);
    size += e * e * T(S(1) / this->factors.links[k].inverse_D);
  }
};

// y(k) of (1), and l+ becomes l-.
template <class T, class S>
KALMARM_INLINE T innovation(const LoweredLink<S>& link, const Sixfold<T>& g, const T& x,
                            Sixfold<T>& l) {
  T& own = link.slides ? l.w : l.z;
  const T& g_own = link.slides ? g.w : g.z;
  const T across = link.slides ? T(g.z * l.z) : T(g.w * l.w);
  const T rest = ((g.x * l.x + g.y * l.y) + (g.u * l.u + g.v * l.v)) + across;
  const T y = (x + (link.has_noise ? T(g_own * own) : own)) + rest;
  own += x;
  return y;
}

}  // namespace detail

// Memory of one state, or of one in every lane.
template <class T>
class EnergySweeps {
 public:
  using S = typename Lanes<T>::Scalar;

  explicit EnergySweeps(const LoweredModel<S>& model)
      : columns_(model),
        motions_(most * model.branch_count()),
        all_(model.nv(), 1),
        forces_(detail::forces_of<T>(model)) {}

  // (1) of n vectors x (nv) at once.
  template <std::size_t n, class Factors>
  KALMARM_SWEEP std::array<EnergySums<T>, n> of(const LoweredModel<S>& model,
                                                const Factors& factors,
                                                const std::array<const T*, n>& x);

  // (2), of d (nv) = M^-1 r, which is written.
  template <class Factors>
  EnergySums<T> solve(const LoweredModel<S>& model, const Factors& factors, const T* r, T* d) {
    SolveSums<T> sums = {T(S(0)), T(S(0)), T(S(0))};
    T size = T(S(0));
    const detail::EnergyObserver<T, S, Factors> observer{{model, factors, forces_, sums}, size};
    if (forces_) forces_->begin();
    detail::sweep_inward(
        model, factors, model.nv() - 1, all_.data(), [&](int k) { return r[k]; }, columns_,
        observer);
    detail::sweep_outward(
        model, factors, model.nv() - 1, columns_,
        [&](int k, const T& x) {
          sums.squares += x * x;
          d[k] = x;
        },
        observer);
    if (forces_) sums.trace = forces_->trace(model, factors);
    return {size, sums.squares, sums.noise, sums.energy, sums.trace};
  }

 private:
  static constexpr std::size_t most = 2;  // vectors at once

  ColumnsWorkspace<T> columns_;
  std::vector<Sixfold<T>> motions_;  // l- of links with several children, of every vector
  std::vector<char> all_;            // links: a path for any r
  std::optional<ForceNoise<T>> forces_;
};

template <class T>
template <std::size_t n, class Factors>
std::array<EnergySums<T>, n> EnergySweeps<T>::of(const LoweredModel<S>& model,
                                                 const Factors& factors,
                                                 const std::array<const T*, n>& x) {
  const T zero = T(S(0));
  std::array<EnergySums<T>, n> out;
  out.fill({zero, zero, zero, zero});
  Sixfold<T> l[n];
  for (int k = 0; k < model.nv(); ++k) {
    const LoweredLink<S>& link = model.link(k);
    const auto& at = factors.links[k];
    const T D = T(S(1)) / at.inverse_D;
    for (std::size_t i = 0; i < n; ++i) {
      if (link.parent < 0)
        detail::set_zero(l[i]);
      else if (!link.hangs_on_previous)
        detail::assign(l[i], motions_[n * model.link(link.parent).branch + i]);
      if (link.parent >= 0) detail::motion_from_parent(model, link, factors, at.d, l[i]);
      const Sixfold<T> plus = l[i];
      const T y = detail::innovation(link, at.g, x[i][k], l[i]);
      out[i].size += D * (y * y);
      out[i].squares += x[i][k] * x[i][k];
      out[i].energy += D * motion_terms(link, at.g, y, plus);
      if (link.branch >= 0) detail::assign(motions_[n * link.branch + i], l[i]);
    }
  }
  return out;
}

}  // namespace kalmarm
