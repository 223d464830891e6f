// M^-1 of one state in every lane: the columns of inverse.hpp, one after another or two at once, with
// everything that depends on the state, factors too, a number for each lane.
//
//   M^-1 = (I - L*) D^-1 (I - L)                      (3.3): lanes are states (columns.hpp)
// Two columns at once hide the latency of a sweep, each step of which depends on the one before. The
// upper triangle is the mirror image of the lower one.
#pragma once

#include <vector>

#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/fast/kinematics/matrix_block.hpp"
#include "algorithms/spatial/flush_subnormals.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

template <class P>
class InverseOfRows {
  using S = typename Lanes<P>::Scalar;
  using Two = Pack<S, 2 * Lanes<P>::count>;

 public:
  explicit InverseOfRows(const LoweredModel<S>& model)
      : q_(model.nq()),
        factors_(model),
        one_(model),
        two_(model),
        paths_(model, model.nv(), 2),
        block_(model.nv()) {}

  // X (nv x nv a state) = M^-1 at so many rows of q, at most as many as there are lanes, of `left`
  // that can be read; both triangles, symmetric to the last bit. About 195 nv + 43 nv^2 flops a lane.
  // Returns 0 in the lanes of which all is finite, else NaN.
  P fill(const LoweredModel<S>& model, const S* q, int states, int left, S* X);

  // Of the last call.
  const FastFactors<P>& factors() const { return factors_; }
  // The first sum of S in (11) of force_noise.hpp.
  const P& energy() const { return energy_; }

 private:
  template <class T>
  P columns(const LoweredModel<S>& model, int first, const char* path, ColumnsWorkspace<T>& ws);

  std::vector<P> q_;
  FastFactors<P> factors_;
  ColumnsWorkspace<P> one_;
  ColumnsWorkspace<Two> two_;
  ColumnPaths paths_;
  MatrixBlock<P> block_;
  P energy_;
};

template <class P>
P InverseOfRows<P>::fill(const LoweredModel<S>& model, const S* q, int states, int left, S* X) {
  to_lanes(q, model.nq(), states, left, q_);
  covariance_factor(model, q_.data(), factors_);
  const FlushSubnormals flush;
  P check = P(S(0));
  energy_ = check;
  int i = 0;
  for_each_chunk(model.nv(), 2, [&](int first, int count) {
    const char* const path = paths_[i++];
    check += count == 1 ? columns(model, first, path, one_) : columns(model, first, path, two_);
  });
  block_.store(states, X);
  return check;
}

template <class P>
template <class T>
P InverseOfRows<P>::columns(const LoweredModel<S>& model, int first, const char* path,
                            ColumnsWorkspace<T>& ws) {
  using Columns = detail::ColumnsOfStates<T, P>;
  const int last = first + Columns::count - 1;
  detail::sweep_inward(
      model, factors_, last, path, [&](int k) { return Columns::unit(k - first); }, ws);
  T check = T(S(0));
  detail::sweep_outward(model, factors_, last, ws, [&](int k, const T& a) {
    check += a * T(S(0));
    for (int i = k == last ? Columns::count - 1 : 0; i < Columns::count; ++i)
      block_.set(k, first + i, Columns::column(a, i));
    if (k >= first) energy_ += Columns::column(a, k - first) / factors_.links[k].inverse_D;
  });
  P sum = Columns::column(check, 0);
  if constexpr (Columns::count == 2) sum += Columns::column(check, 1);
  return sum;
}

}  // namespace kalmarm
