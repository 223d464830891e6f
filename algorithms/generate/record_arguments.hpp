// Inputs and outputs of a task's record, while its graph records.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "algorithms/generate/recorded.hpp"
#include "algorithms/generate/task.hpp"

namespace kalmarm {

// The next input; value(i): of its entry i in the reference state.
template <class Value>
std::vector<Recorded> add_input(TaskRecord& record, const std::string& name, int size,
                                const Value& value) {
  record.inputs.push_back({name, size});
  std::vector<Recorded> x;
  for (int i = 0; i < size; ++i) x.push_back(Recorded::input(value(i)));
  return x;
}

// Without a reference state.
inline std::vector<Recorded> add_input(TaskRecord& record, const std::string& name, int size) {
  return add_input(record, name, size,
                   [](int) { return std::numeric_limits<double>::quiet_NaN(); });
}

template <class Numbers>
void add_output(TaskRecord& record, const std::string& name, const Numbers& x) {
  record.outputs.push_back({name, static_cast<int>(x.size())});
  for (const Recorded& number : x) record.results.push_back(number.node());
}

}  // namespace kalmarm
