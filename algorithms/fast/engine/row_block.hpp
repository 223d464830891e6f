// Rows of states, which are taken lanes at a time: the memory of one worker.
#pragma once

#include <vector>

#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/spatial/lanes.hpp"
#include "kalmarm/call.hpp"

namespace kalmarm {

template <class S>
struct RowBlock {
  using P = StateLanes<S>;
  static constexpr int lanes = Lanes<P>::count;

  std::vector<P> q, qd, tau, forces, out;

  explicit RowBlock(const LoweredModel<S>& model)
      : q(model.nq()),
        qd(model.nv()),
        tau(model.nv()),
        forces(6 * model.acted_on().size()),
        out(model.nv()) {}

  // The first states of call's rows, of `left` that can be read.
  void load(const LoweredModel<S>& model, const Call<S>& call, int states, int left) {
    to_lanes(call.q, model.nq(), states, left, q);
    to_lanes(call.qd, model.nv(), states, left, qd);
    to_lanes(call.tau, model.nv(), states, left, tau);
    if (call.forces) to_lanes(call.forces, static_cast<int>(forces.size()), states, left, forces);
  }

  // What acts from outside, of a call that is loaded.
  Acting<P> acting(const Call<S>& call) const {
    return {call.forces ? forces.data() : nullptr, call.axes};
  }

  void store(int states, S* rows) const {
    from_lanes(out, static_cast<int>(out.size()), states, rows);
  }
};

// f() of every `at_once` rows, or less, whose `choice` is set, and which `chosen` then has.
template <class F>
void for_each_chosen(int count, const char* choice, int at_once, std::vector<int>& chosen,
                     const F& f) {
  for (int next = 0; next < count;) {
    chosen.clear();
    for (; next < count && static_cast<int>(chosen.size()) < at_once; ++next)
      if (choice[next]) chosen.push_back(next);
    if (!chosen.empty()) f();
  }
}

}  // namespace kalmarm
