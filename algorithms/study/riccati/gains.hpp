// D(k) and g(k) of every joint, (3.6) and (3.10): all that the filter, the smoother and Result 6.1
// need, whatever update they are from.
#pragma once

#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm {

template <class T>
struct Gains {
  std::vector<T> D;
  std::vector<Vector6<T>> g;
  bool exact_constraint = false;  // HP+ = 0 to the last bit where r = 0

  Gains(const Model<T>& model, bool exact)
      : D(model.nv()), g(model.nv()), exact_constraint(exact) {}

  bool exact_at(const Joint<T>& joint) const { return exact_constraint && joint.r == T(0); }
};

}  // namespace kalmarm
