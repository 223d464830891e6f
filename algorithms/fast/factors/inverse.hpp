// M^-1 by the fast path, from factors.
//
//   M^-1 = (I - L*) D^-1 (I - L)                      (3.3): lanes are columns (columns.hpp)
//   M^-1(m,j) = n(m)' phi psi(m+1) ... phi g(j),  psi = I - g H:  long chains, by blocks.hpp
//
// Along a branch M^-1(m,j) decays with the distance of its joints, in float32 to subnormal numbers
// within some hundred links. What is below the smallest normal number is taken for zero and written
// as zero (flush_subnormals.hpp): beside sqrt(M^-1(m,m) M^-1(j,j)) it is nothing.
#pragma once

#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/fast/factors/lambda.hpp"
#include "algorithms/fast/kinematics/blocks.hpp"
#include "algorithms/spatial/flush_subnormals.hpp"

namespace kalmarm {

namespace detail {

// M^-1 of a chain, for Blocks: Phi = phi (1 - g H), N = n, Z = phi g, and 1 / D + g'y on the
// diagonal.
template <class S>
struct InverseOfChain {
  const LoweredModel<S>& model;
  const FastFactors<S>& factors;
  const LambdaWorkspace<S>& lambda;

  const Sixfold<S>& N(int k) const { return lambda.n[k]; }

  template <class T>
  KALMARM_INLINE void Phi_times(int k, Sixfold<T>& v) const {
    motion_from_parent(model, model.link(k), factors, factors.links[k].d, v);
    smooth(model.link(k), factors.links[k].g, T(S(0)), v);
  }

  template <class T>
  KALMARM_INLINE T enter(int k, const T& own, Sixfold<T>& z) const {
    const Sixfold<S>& n = lambda.n[k];
    const T x = (n.x * z.x + n.y * z.y + n.z * z.z) + (n.u * z.u + n.v * z.v + n.w * z.w) +
                own * lambda.alpha[k];
    gain(model, k, factors.links[k], own, z);
    if (k > 0) force_to_parent(model, model.link(k), factors, factors.links[k].d, z);
    return x;
  }
};

}  // namespace detail

// The first sum of S in (11) of force_noise.hpp, for X = M^-1 by these factors.
template <class S>
S energy_of_columns(const FastFactors<S>& factors, const S* X) {
  const std::size_t nv = factors.links.size();
  S sum = S(0);
  for (std::size_t k = 0; k < nv; ++k) sum += X[k * nv + k] / factors.links[k].inverse_D;
  return sum;
}

template <class S>
class InverseColumns {
 public:
  explicit InverseColumns(const LoweredModel<S>& model, Triangles triangles = Triangles::both)
      : by_blocks_(is_chain(model, 6 * lanes)),
        triangles_(triangles),
        lambda_(model),
        blocks_(model.nv(), triangles),
        few_(model),
        many_(model),
        paths_(model, by_blocks_ ? 0 : model.nv(), lanes) {}

  // X (nv x nv) = M^-1, symmetric to the last bit, no entry subnormal (on x86).
  // About 44 nv^2 flops, of long chains 2300 nv + 8 nv^2. Returns 0 if all of it is finite, else NaN.
  S fill(const LoweredModel<S>& model, const FastFactors<S>& factors, S* X);

 private:
  using Few = WidePack<S>;
  using Many = TwoPacks<S>;
  static constexpr int lanes = Lanes<Many>::count;

  template <class T>
  static S columns(const LoweredModel<S>& model, const FastFactors<S>& factors, int first,
                   int count, const char* path, ColumnsWorkspace<T>& ws, S* X);

  bool by_blocks_;  // where they are faster than columns
  Triangles triangles_;
  LambdaWorkspace<S> lambda_;
  Blocks<S> blocks_;
  ColumnsWorkspace<Few> few_;
  ColumnsWorkspace<Many> many_;
  ColumnPaths paths_;
};

template <class S>
S InverseColumns<S>::fill(const LoweredModel<S>& model, const FastFactors<S>& factors, S* X) {
  const FlushSubnormals flush;
  S check = S(0);
  if (by_blocks_) {
    fast_lambda(model, factors, lambda_);
    blocks_.fill(detail::InverseOfChain<S>{model, factors, lambda_}, model.nv(), X);
    for (const S& alpha : lambda_.alpha) check += alpha * S(0);
    return check;
  }
  int i = 0;
  for_each_chunk(model.nv(), lanes, [&](int first, int count) {
    const char* const path = paths_[i++];
    check += count <= Lanes<Few>::count ? columns(model, factors, first, count, path, few_, X)
                                        : columns(model, factors, first, count, path, many_, X);
  });
  if (triangles_ == Triangles::both) mirror(model.nv(), X);
  return check;
}

template <class S>
template <class T>
S InverseColumns<S>::columns(const LoweredModel<S>& model, const FastFactors<S>& factors, int first,
                             int count, const char* path, ColumnsWorkspace<T>& ws, S* X) {
  const int last = first + count - 1, nv = model.nv();
  detail::sweep_inward(
      model, factors, last, path, [&](int k) { return detail::Unit<T>::lane(k - first); }, ws);
  T check = T(S(0));
  detail::sweep_outward(model, factors, last, ws, [&](int k, const T& a) {
    check += a * T(S(0));
    store_rows(a, first, k, nv, X);
  });
  S sum = S(0);
  for (int i = 0; i < Lanes<T>::count; ++i) sum += check[i];
  return sum;
}

}  // namespace kalmarm
