// M^-1 of one state in every lane: the columns of inverse.hpp, with everything that depends on the
// state, factors too, a number for each lane.
//
//   M^-1 = (I - L*) D^-1 (I - L)                      (3.3): lanes are states (columns.hpp)
#pragma once

#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/fast/kinematics/acting_in_lanes.hpp"
#include "algorithms/fast/kinematics/matrix_of_rows.hpp"
#include "algorithms/spatial/flush_subnormals.hpp"

namespace kalmarm {

template <class P>
class InverseOfRows : MatrixOfRows<P> {
  using typename MatrixOfRows<P>::S;

 public:
  explicit InverseOfRows(const LoweredModel<S>& model)
      : MatrixOfRows<P>(model), contacts_(model.widths().c, model.widths().l), factors_(model) {}

  // X (nv x nv a state) = M^-1, or H^-1, at so many rows of q, at most as many as there are lanes, of `left`
  // that can be read; both triangles, symmetric to the last bit. About 195 nv + 43 nv^2 flops a lane.
  // Returns 0 in the lanes of which all is finite, else NaN.
  P fill(const LoweredModel<S>& model, const S* q, const Acting<S>& contacts, int states, int left,
         S* X);

  // Of the last call.
  const FastFactors<P>& factors() const { return factors_; }
  // The first sum of S in (11) of force_noise.hpp.
  const P& energy() const { return energy_; }

 private:
  ActingInLanes<P> contacts_;
  FastFactors<P> factors_;
  P energy_;
};

template <class P>
P InverseOfRows<P>::fill(const LoweredModel<S>& model, const S* q, const Acting<S>& contacts,
                         int states, int left, S* X) {
  covariance_factor(model, this->load(q, states, left), factors_,
                    contacts_.load(contacts, states, left));
  const FlushSubnormals flush;
  energy_ = P(S(0));
  return this->fill_columns(
      states, X,
      [&]<class T>(int first, int last, const char* path, ColumnsWorkspace<T>& ws,
                   const auto& set) {
        using Columns = detail::ColumnsOfStates<T, P>;
        detail::sweep_inward(
            model, factors_, last, path, [&](int k) { return Columns::unit(k - first); }, ws);
        detail::sweep_outward(model, factors_, last, ws, [&](int k, const T& a) {
          set(k, a);
          if (k >= first) energy_ += Columns::column(a, k - first) / factors_.links[k].inverse_D;
        });
      });
}

}  // namespace kalmarm
