// M^-1 by the fast path, and M^-1 tau for many tau on factors that are kept.
//
//   M^-1 = (I - L*) D^-1 (I - L)                      (3.3): lanes are columns (columns.hpp)
//   M^-1(m,j) = n(m)' phi psi(m+1) ... phi g(j),  psi = I - g H:  long chains, by blocks.hpp
//   diag M^-1 = 1/D + g'Lambda+ g (lambda.hpp),  log det M = sum of log D,  B'M^-1 B (selected.hpp)
// A suspect is looked into, and answered, by the fallback (dynamics.hpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "algorithms/spatial/lanes.hpp"
#include "algorithms/structured/blocks.hpp"
#include "algorithms/structured/columns.hpp"
#include "algorithms/structured/dynamics.hpp"
#include "algorithms/structured/lambda.hpp"
#include "algorithms/structured/selected.hpp"

namespace kalmarm {

namespace detail {

// M^-1 of a chain, for Blocks: Phi = phi (1 - g H), N = n, Z = phi g, and 1 / D + g'y on the
// diagonal.
template <class S>
struct InverseOfChain {
  const StructuredModel<S>& model;
  const StructuredFactors<S>& factors;
  const LambdaWorkspace<S>& lambda;

  const Sixfold<S>& N(int k) const { return lambda.n[k]; }

  template <class T>
  [[gnu::always_inline]] void Phi_times(int k, Sixfold<T>& v) const {
    motion_from_parent(model, model.link(k), factors, factors.links[k].d, v);
    smooth(model.link(k), factors.links[k].g, T(S(0)), v);
  }

  template <class T>
  [[gnu::always_inline]] T enter(int k, const T& own, Sixfold<T>& z) const {
    const Sixfold<S>& n = lambda.n[k];
    const T x = (n.x * z.x + n.y * z.y + n.z * z.z) + (n.u * z.u + n.v * z.v + n.w * z.w) +
                own * lambda.alpha[k];
    gain(model.link(k), factors.links[k].g, own, z);
    if (k > 0) force_to_parent(model, model.link(k), factors, factors.links[k].d, z);
    return x;
  }
};

}  // namespace detail

// log det M = -sum of log 1/D, as one product whose exponent is kept apart: nothing overflows, and
// the error is about nv / 2 roundoffs. Not finite where a D is not, or is zero.
template <class S>
S log_det(const StructuredFactors<S>& factors) {
  using std::abs;
  using std::frexp;
  using std::log;
  constexpr double small = 0x1p-60;
  S product = S(1);
  long exponent = 0;
  const auto mantissa = [&exponent](const S& x) {
    int own = 0;
    const S out = frexp(x, &own);
    exponent += own;
    return out;
  };
  for (const auto& at : factors.links) {
    product *= mantissa(at.inverse_D);
    if (abs(product) < S(small)) product = mantissa(product);
  }
  return -(log(product) + S(exponent) * S(std::numbers::ln2));
}

template <class S, class Form = CovarianceForm>
class StructuredInverse {
 public:
  explicit StructuredInverse(const Model<S>& model, Zeros zeros = Zeros::left_out)
      : model_(model, zeros),
        factoring_(model_),
        factors_(model_),
        lambda_(model_),
        blocks_(model_.nv()),
        by_blocks_(is_chain(model_, 6 * lanes)),
        few_(model_),
        many_(model_),
        one_(model_),
        paths_(model_, by_blocks_ ? 0 : model_.nv(), lanes),
        all_(model_.nv(), 1),
        block_(model_.nv()),
        fallback_(model, model_) {}

  // X (nv x nv) = M^-1 at q (nq), both triangles, symmetric to the last bit. About 195 nv + 44 nv^2
  // flops, of long chains 2500 nv + 8 nv^2. On failure X is not to be used.
  Outcome inverse(const VectorX<S>& q, MatrixX<S>& X) {
    factoring_.factor(model_, q.data(), factors_);
    if (by_blocks_) {
      structured_lambda(model_, factors_, lambda_);
      blocks_.fill(detail::InverseOfChain<S>{model_, factors_, lambda_}, model_.nv(), X.data());
      S check = S(0);
      for (const S& alpha : lambda_.alpha) check += alpha * S(0);
      return suspects(q, check) ? fallback_.inverse(q.data(), X) : Outcome{};
    }
    S check = S(0);
    int i = 0;
    for_each_chunk(model_.nv(), lanes, [&](int first, int count) {
      const char* const path = paths_[i++];
      check += count <= few ? columns(first, count, path, few_, X)
                            : columns(first, count, path, many_, X);
    });
    mirror(model_.nv(), X.data());
    return suspects(q, check) ? fallback_.inverse(q.data(), X) : Outcome{};
  }

  // x (nv) = the diagonal of M^-1 at q (nq). About 445 nv flops. On failure x is not to be used.
  Outcome diagonal(const VectorX<S>& q, VectorX<S>& x) {
    factoring_.factor(model_, q.data(), factors_);
    diagonal_of_factors(x);
    const S check = (x * S(0)).sum();
    return suspects(q, check) ? fallback_.diagonal(q.data(), x) : Outcome{};
  }

  // x = log det M at q (nq). About 195 nv flops, and one logarithm. On failure x is not to be used.
  Outcome log_det(const VectorX<S>& q, S& x) {
    factoring_.factor(model_, q.data(), factors_);
    x = kalmarm::log_det(factors_);
    return suspects(q, S(x * S(0))) ? fallback_.log_det(q.data(), x) : Outcome{};
  }

  // What `selected` is about from now on; takes its memory. DoF and links are those of the model.
  void select(const Selection<S>& selection) {
    selected_.select(model_, selection);
    fallback_.select(selection);
  }

  // X (size x size of the selection) = B'M^-1 B at q (nq), both triangles, symmetric to the last
  // bit. About 195 nv flops, and what selected.hpp says. On failure X is not to be used.
  Outcome selected(const VectorX<S>& q, MatrixX<S>& X) {
    factoring_.factor(model_, q.data(), factors_);
    const S check = selected_.fill(model_, factors_, X);
    return suspects(q, check) ? fallback_.selected(q.data(), X) : Outcome{};
  }

  // The factors at q (nq), for what follows. On failure that is not to be used. About 195 nv flops.
  Outcome factor(const VectorX<S>& q) {
    factoring_.factor(model_, q.data(), factors_);
    S check = S(0);
    for (const auto& at : factors_.links) check += at.inverse_D * S(0);
    by_fallback_ = suspects(q, check);
    return by_fallback_ ? fallback_.factor(q.data()) : Outcome{};
  }

  // x (nv) = M^-1 tau (nv), after factor. About 87 nv flops.
  void solve(const VectorX<S>& tau, VectorX<S>& x) {
    if (by_fallback_) return fallback_.solve(tau, x);
    const int last = model_.nv() - 1;
    detail::sweep_inward(
        model_, factors_, last, all_.data(), [&](int k) { return tau[k]; }, one_);
    detail::sweep_outward(model_, factors_, last, one_, [&](int k, const S& a) { x[k] = a; });
  }

  // X (nv x m) = M^-1 T (nv x m), after factor. About 87 nv m flops.
  void solve(const MatrixX<S>& T, MatrixX<S>& X) {
    if (by_fallback_) return fallback_.solve(T, X);
    const int nv = model_.nv(), m = static_cast<int>(T.cols());
    for (int first = 0; first < m; first += few) {
      const int count = std::min(few, m - first);
      const std::ptrdiff_t start = std::ptrdiff_t(first) * nv;
      to_lanes(T.data() + start, nv, count, m - first, block_);
      detail::sweep_inward(
          model_, factors_, nv - 1, all_.data(), [&](int k) { return block_[k]; }, few_);
      detail::sweep_outward(model_, factors_, nv - 1, few_,
                            [&](int k, const Few& a) { block_[k] = a; });
      from_lanes(block_, nv, count, X.data() + start);
    }
  }

  // x (nv) = the diagonal of M^-1, after factor. About 250 nv flops.
  void diagonal(VectorX<S>& x) {
    if (by_fallback_) return fallback_.diagonal(x);
    diagonal_of_factors(x);
  }

 private:
  using Few = WidePack<S>;
  using Many = Twin<WidePack<S>>;
  static constexpr int few = Lanes<Few>::count, lanes = Lanes<Many>::count;

  template <class T>
  S columns(int first, int count, const char* path, ColumnsWorkspace<T>& ws, MatrixX<S>& X) {
    detail::sweep_inward(
        model_, factors_, first + count - 1, path,
        [&](int k) { return detail::Unit<T>::lane(k - first); }, ws);
    T check = T(S(0));
    const int nv = model_.nv();
    detail::sweep_outward(model_, factors_, first + count - 1, ws, [&](int k, const T& a) {
      check += a * T(S(0));
      store_rows(a, first, k, nv, X.data());
    });
    S sum = S(0);
    for (int i = 0; i < Lanes<T>::count; ++i) sum += check[i];
    return sum;
  }

  void diagonal_of_factors(VectorX<S>& x) {
    structured_lambda(model_, factors_, lambda_);
    for (int k = 0; k < model_.nv(); ++k) x[k] = lambda_.alpha[k];
  }

  bool suspects(const VectorX<S>& q, const S& check) {
    return fallback_.suspects(model_, q.data(), factors_, check);
  }

  StructuredModel<S> model_;
  typename Form::template Factoring<S> factoring_;
  StructuredFactors<S> factors_;
  LambdaWorkspace<S> lambda_;
  SelectedColumns<S> selected_;
  Blocks<S> blocks_;
  bool by_blocks_;  // where they are faster than columns
  ColumnsWorkspace<Few> few_;
  ColumnsWorkspace<Many> many_;
  ColumnsWorkspace<S> one_;
  ColumnPaths paths_;
  std::vector<char> all_;     // links: a path for any tau
  std::vector<Few> block_;    // of right-hand sides
  bool by_fallback_ = false;  // the factors that are kept
  detail::Fallback<S, Form> fallback_;
};

}  // namespace kalmarm
