// The links outboard of every joint, parents before children: where a change of a joint's motion is
// felt. Joints and their outboard links make O(N depth) pairs.
#pragma once

#include <span>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm {

class Subtrees {
 public:
  template <class T>
  explicit Subtrees(const Model<T>& model) : links_(model.nv()) {
    for (int b = 0; b < model.nv(); ++b)
      for (int k = model.parent(b); k >= 0; k = model.parent(k)) links_[k].push_back(b);
  }

  // Those of link k, without itself.
  std::span<const int> outboard(int k) const { return links_[k]; }

 private:
  std::vector<std::vector<int>> links_;
};

}  // namespace kalmarm
