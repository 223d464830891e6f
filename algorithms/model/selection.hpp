// Which rows and columns of B' M^-1 B are asked for: the columns of B = [e(j) of every DoF j, J' of
// every frame].
#pragma once

#include <vector>

#include "kalmarm/robot_model.hpp"

namespace kalmarm {

struct Selection {
  std::vector<int> dofs;
  std::vector<Frame> frames;

  int size() const { return static_cast<int>(dofs.size() + 6 * frames.size()); }
};

}  // namespace kalmarm
