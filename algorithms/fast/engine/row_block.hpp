// Rows of states, which are taken lanes at a time: the memory of one worker.
#pragma once

#include <vector>

#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/kinematics/acting_in_lanes.hpp"
#include "algorithms/spatial/lanes.hpp"
#include "kalmarm/call.hpp"

namespace kalmarm {

template <class S>
struct RowBlock {
  using P = StateLanes<S>;
  static constexpr int lanes = Lanes<P>::count;

  std::vector<P> q, qd, tau, out;
  Acting<P> acting;  // of the call that is loaded

  explicit RowBlock(const LoweredModel<S>& model)
      : q(model.nq()),
        qd(model.nv()),
        tau(model.nv()),
        out(model.nv()),
        given_(model.widths().f, model.widths().l) {}

  // The first states of call's rows, of `left` that can be read.
  void load(const LoweredModel<S>& model, const Call<S>& call, int states, int left) {
    to_lanes(call.q, model.nq(), states, left, q);
    to_lanes(call.qd, model.nv(), states, left, qd);
    to_lanes(call.tau, model.nv(), states, left, tau);
    acting = given_.load(forces_of(call), states, left);
  }

  void store(int states, S* rows) const {
    from_lanes(out, static_cast<int>(out.size()), states, rows);
  }

 private:
  ActingInLanes<P> given_;
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
