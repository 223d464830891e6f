// M of one state in every lane: composite inertias (composite.hpp) and the columns of mass.hpp, one
// after another or two at once, with everything that depends on the state a number for each lane.
#pragma once

#include <vector>

#include "algorithms/fast/kinematics/matrix_block.hpp"
#include "algorithms/fast/rigid/mass.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

template <class P>
class MassOfRows {
  using S = typename Lanes<P>::Scalar;
  using Two = Pack<S, 2 * Lanes<P>::count>;

 public:
  explicit MassOfRows(const LoweredModel<S>& model)
      : q_(model.nq()),
        composite_(model),
        one_(model),
        two_(model),
        paths_(model, model.nv(), 2),
        block_(model.nv()) {}

  // M (nv x nv a state) at so many rows of q, at most as many as there are lanes, of `left` that can be
  // read; both triangles, symmetric to the last bit. About 80 nv + 13 nv^2 flops a lane. Returns 0 in
  // the lanes of which all is finite, else NaN.
  P fill(const LoweredModel<S>& model, const S* q, int states, int left, S* M);

 private:
  template <class T>
  P columns(const LoweredModel<S>& model, int first, const char* path, ColumnsWorkspace<T>& ws);

  std::vector<P> q_;
  CompositeForces<P> composite_;
  ColumnsWorkspace<P> one_;
  ColumnsWorkspace<Two> two_;
  ColumnPaths paths_;
  MatrixBlock<P> block_;
};

template <class P>
P MassOfRows<P>::fill(const LoweredModel<S>& model, const S* q, int states, int left, S* M) {
  to_lanes(q, model.nq(), states, left, q_);
  composite_forces(model, q_.data(), composite_);
  P check = P(S(0));
  int i = 0;
  for_each_chunk(model.nv(), 2, [&](int first, int count) {
    const char* const path = paths_[i++];
    check += count == 1 ? columns(model, first, path, one_) : columns(model, first, path, two_);
  });
  block_.store(states, M);
  return check;
}

template <class P>
template <class T>
P MassOfRows<P>::columns(const LoweredModel<S>& model, int first, const char* path,
                         ColumnsWorkspace<T>& ws) {
  using Columns = detail::ColumnsOfStates<T, P>;
  const int last = first + Columns::count - 1;
  detail::sweep_composite_forces(
      model, composite_, first, last, path, [](int i) { return Columns::unit(i); }, ws);
  T check = T(S(0));
  for (int k = 0; k <= last; ++k) {
    check += ws.e[k] * T(S(0));
    for (int i = k == last ? Columns::count - 1 : 0; i < Columns::count; ++i)
      block_.set(k, first + i, Columns::column(ws.e[k], i));
  }
  P sum = Columns::column(check, 0);
  if constexpr (Columns::count == 2) sum += Columns::column(check, 1);
  return sum;
}

}  // namespace kalmarm
