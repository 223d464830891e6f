// M of one state in every lane: composite inertias (composite.hpp) and the columns of mass.hpp, with
// everything that depends on the state a number for each lane.
#pragma once

#include "algorithms/fast/kinematics/acting_in_lanes.hpp"
#include "algorithms/fast/kinematics/matrix_of_rows.hpp"
#include "algorithms/fast/rigid/mass.hpp"

namespace kalmarm {

template <class P>
class MassOfRows : MatrixOfRows<P> {
  using typename MatrixOfRows<P>::S;

 public:
  explicit MassOfRows(const LoweredModel<S>& model)
      : MatrixOfRows<P>(model), loads_(0, model.widths().l), composite_(model) {}

  // M (nv x nv a state) with these loads at so many rows of q, at most as many as there are lanes, of `left` that can be
  // read; both triangles, symmetric to the last bit. About 80 nv + 13 nv^2 flops a lane. Returns 0 in
  // the lanes of which all is finite, else NaN.
  P fill(const LoweredModel<S>& model, const S* q, const Acting<S>& loads, int states, int left,
         S* M);

 private:
  ActingInLanes<P> loads_;
  CompositeForces<P> composite_;
};

template <class P>
P MassOfRows<P>::fill(const LoweredModel<S>& model, const S* q, const Acting<S>& loads, int states,
                      int left, S* M) {
  composite_forces(model, this->load(q, states, left), composite_,
                   loads_.load({.loads = loads.loads}, states, left));
  return this->fill_columns(states, M,
                            [&]<class T>(int first, int last, const char* path,
                                         ColumnsWorkspace<T>& ws, const auto& set) {
                              using Columns = detail::ColumnsOfStates<T, P>;
                              detail::sweep_composite_forces(
                                  model, composite_, first, last, path,
                                  [](int i) { return Columns::unit(i); }, ws);
                              for (int k = 0; k <= last; ++k) set(k, ws.e[k]);
                            });
}

}  // namespace kalmarm
