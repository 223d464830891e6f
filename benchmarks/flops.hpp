// Flops of a call of the fast path, counted by running it once.
#pragma once

#include <vector>

#include "algorithms/spatial/count.hpp"
#include "algorithms/structured/dynamics.hpp"

namespace kalmarm {

// Of one state's acceleration; sines and cosines are not counted.
template <class Form>
double acceleration_flops(const Model<double>& parameters, const VectorX<double>& q,
                          const VectorX<double>& qd, const VectorX<double>& tau) {
  const StructuredModel<double> model(parameters);
  typename Form::template Workspace<Count> ws(model);
  const auto counts = [](const VectorX<double>& x) {
    return std::vector<Count>(x.begin(), x.end());
  };
  const std::vector<Count> cq = counts(q), cqd = counts(qd), ctau = counts(tau);
  std::vector<Count> out(model.nv());
  Count::flops = 0;
  Form::acceleration(model, cq.data(), cqd.data(), ctau.data(), ws, out.data());
  return static_cast<double>(Count::flops);
}

}  // namespace kalmarm
