// Rows of states, which are taken lanes at a time: the memory of one worker.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

template <class S>
struct RowBlock {
  using P = StateLanes<S>;
  static constexpr int lanes = Lanes<P>::count;

  std::vector<P> q, qd, tau_or_qdd, out;

  explicit RowBlock(const LoweredModel<S>& model)
      : q(model.nq()), qd(model.nv()), tau_or_qdd(model.nv()), out(model.nv()) {}

  // f(first, states, store) of every block of rows; store() copies `out` to where the answers go.
  template <class F>
  void for_each(const LoweredModel<S>& model, int count, const S* q_rows, const S* qd_rows,
                const S* tau_or_qdd_rows, S* out_rows, const F& f) {
    const int nq = model.nq(), nv = model.nv();
    for (int first = 0; first < count; first += lanes) {
      const int left = count - first, states = std::min(lanes, left);
      const std::ptrdiff_t i = first;
      to_lanes(q_rows + i * nq, nq, states, left, q);
      to_lanes(qd_rows + i * nv, nv, states, left, qd);
      to_lanes(tau_or_qdd_rows + i * nv, nv, states, left, tau_or_qdd);
      f(first, states, [&] { from_lanes(out, nv, states, out_rows + i * nv); });
    }
  }
};

}  // namespace kalmarm
