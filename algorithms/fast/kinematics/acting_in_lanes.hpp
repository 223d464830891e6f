// What calls give of frames (acting.hpp), of one state in every lane.
#pragma once

#include <vector>

#include "algorithms/fast/kinematics/acting.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

template <class P>
class ActingInLanes {
  using S = typename Lanes<P>::Scalar;

 public:
  // forces: numbers of a state, of forces or of contacts; loads: likewise.
  ActingInLanes(std::ptrdiff_t forces, std::ptrdiff_t loads)
      : forces_(forces), loads_(loads), gravity_(numbers_of_gravity) {}

  // Of `states` states, of `left` that can be read.
  Acting<P> load(const Acting<S>& of_states, int states, int left) {
    const auto lanes = [&](const S* rows, std::vector<P>& to) -> const P* {
      if (!rows) return nullptr;
      to_lanes(rows, static_cast<int>(to.size()), states, left, to);
      return to.data();
    };
    return {lanes(of_states.forces, forces_), of_states.axes, lanes(of_states.loads, loads_),
            lanes(of_states.gravity, gravity_)};
  }

 private:
  std::vector<P> forces_, loads_, gravity_;
};

}  // namespace kalmarm
