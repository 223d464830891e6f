// M^-1 by the fast path, and M^-1 tau for many tau on factors that are kept.
#pragma once

#include <vector>

#include "algorithms/structured/columns.hpp"
#include "algorithms/structured/dynamics.hpp"
#include "algorithms/structured/lower_triangle.hpp"

namespace kalmarm {

template <class S>
class StructuredInverse {
 public:
  explicit StructuredInverse(const Model<S>& model)
      : model_(model),
        factors_(model_),
        few_(model_),
        many_(model_),
        one_(model_),
        paths_(model_, lanes),
        all_(model_.nv(), 1),
        judge_(model) {}

  // M^-1 (nv x nv), both triangles.
  Outcome inverse(const VectorX<S>& q, MatrixX<S>& X) {
    structured_factor(model_, q.data(), factors_);
    S check = S(0);
    int i = 0;
    for_each_chunk(model_.nv(), lanes, [&](int first, int count) {
      const char* const path = paths_[i++];
      check += count <= few ? columns(first, count, path, few_, X)
                            : columns(first, count, path, many_, X);
    });
    mirror(model_.nv(), X.data());
    return outcome(q, check);
  }

  Outcome factor(const VectorX<S>& q) {
    structured_factor(model_, q.data(), factors_);
    return outcome(q, S(0));
  }

  void solve(const VectorX<S>& tau, VectorX<S>& x) {
    detail::sweep_inward(
        model_, factors_, model_.nv() - 1, all_.data(), [&](int k) { return tau[k]; }, one_);
    detail::sweep_outward(model_, factors_, model_.nv() - 1, one_,
                          [&](int k, const S& a) { x[k] = a; });
  }
  void diagonal(VectorX<S>&) {}

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

  Outcome outcome(const VectorX<S>& q, const S& check) {
    const S margin = factors_.margin;
    return judge_.suspects(margin, check) ? judge_.judge(q.data(), check) : Outcome{};
  }

  StructuredModel<S> model_;
  StructuredFactors<S> factors_;
  ColumnsWorkspace<Few> few_;
  ColumnsWorkspace<Many> many_;
  ColumnsWorkspace<S> one_;
  ColumnPaths paths_;
  std::vector<char> all_;
  detail::Judge<S, Conventional> judge_;
};

}  // namespace kalmarm
