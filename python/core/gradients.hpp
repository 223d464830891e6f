// Arrays of derivatives, each of which may not be asked for.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <span>

#include "arrays.hpp"
#include "robot.hpp"

namespace kalmarm::python {

struct Result {
  nb::object array = nb::none();
  npy_intp width = 0;  // numbers of a state
};

// One of kalmarm.results, which has them in this order.
nb::object named(const char* type, std::span<const Result> results);

template <class T>
std::optional<RowsView<T>> rows_in(const Result& result, int count) {
  if (result.array.is_none()) return {};
  return RowsView<T>(data_of<T>(result.array), count, result.width);
}

template <class T>
void lose(std::span<const Result> results, int row) {
  for (const Result& one : results)
    if (!one.array.is_none())
      std::fill_n(data_of<T>(one.array) + row * one.width, one.width,
                  std::numeric_limits<T>::quiet_NaN());
}

}  // namespace kalmarm::python
