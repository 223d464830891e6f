// A frame (robot_model.hpp) on the links of a lowered model: a constant pose (A, s) in its link's axes as
// lowered_model.hpp puts them.
#pragma once

#include <vector>

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

template <class S>
struct LoweredFrame {
  int link;              // -1: the fixed base
  Matrix3<S> A;          // its axes, column by column
  Vector3<S> s;          // its origin
  std::vector<int> way;  // links from the base to it
  std::vector<S>
      reach;  // how far its link's origin can be from that of each of them; beyond a slide infinite
};

}  // namespace kalmarm
