// The diagonal of M^-1 on the fast path, from factors and an inward sweep alone:
//
//   M^-1(k,k) = sum over m of e(m)^2 / D(m),   tau the unit vector of k                  (3.3)
// m on the way from k to the base; lanes are columns, or states (columns.hpp). All terms are positive:
// nothing cancels but within e. About 45 flops a link on the way and lane.
//
// A joint is visited once for every register of columns outboard of it. Of long chains (about 40
// joints in float64 and 80 in float32) alpha of lambda.hpp takes less, a difference of larger numbers
// in a robot whose inertias differ by many powers of ten: what has to be right says `positive`.
#pragma once

#include <vector>

#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/fast/factors/lambda.hpp"

namespace kalmarm {

// T: a scalar, or a pack that has a state in every lane.
template <class T>
class InverseDiagonal {
  using S = typename Lanes<T>::Scalar;

 public:
  enum class Terms { positive, fewest };

  // Rows of states have the terms that one state has.
  InverseDiagonal(const LoweredModel<S>& model, Terms terms)
      : paths_(model, model.nv(), Columns::count), columns_(model), lambda_(model) {
    const ColumnPaths of_one_state(model, model.nv(), at_once);
    int visits = 0, chunk = 0;
    for_each_chunk(model.nv(), at_once, [&](int, int) {
      const char* const path = of_one_state[chunk++];
      for (int k = 0; k < model.nv(); ++k) visits += path[k];
    });
    by_lambda_ = terms == Terms::fewest && visits > 3 * model.nv();
  }

  // x (nv). Returns 0 if all of it is finite, else NaN.
  T fill(const LoweredModel<S>& model, const FastFactors<T>& factors, T* x);

 private:
  static constexpr int at_once = Lanes<WidePack<S>>::count;  // columns of one state
  using Columns = detail::ColumnsOf<T, at_once>;
  using Lane = typename Columns::Lane;

  struct Summed {
    const FastFactors<T>& factors;
    Lane& sum;

    void gathered(int, const Sixfold<Lane>&) const {}
    KALMARM_INLINE void measured(int k, const Lane& e) const {
      sum += e * e * Lane(factors.links[k].inverse_D);
    }
  };

  bool by_lambda_;
  ColumnPaths paths_;
  ColumnsWorkspace<Lane> columns_;
  LambdaWorkspace<T> lambda_;
};

template <class T>
T InverseDiagonal<T>::fill(const LoweredModel<S>& model, const FastFactors<T>& factors, T* x) {
  T check = T(S(0));
  if (by_lambda_) {
    fast_lambda(model, factors, lambda_);
    for (int k = 0; k < model.nv(); ++k) check += (x[k] = lambda_.alpha[k]) * T(S(0));
    return check;
  }
  int chunk = 0;
  for_each_chunk(model.nv(), Columns::count, [&](int first, int count) {
    Lane sum = Lane(S(0));
    detail::sweep_inward(
        model, factors, first + count - 1, paths_[chunk++],
        [&](int k) { return Columns::unit(k - first); }, columns_, Summed{factors, sum});
    for (int i = 0; i < count; ++i) check += (x[first + i] = Columns::column(sum, i)) * T(S(0));
  });
  return check;
}

}  // namespace kalmarm
