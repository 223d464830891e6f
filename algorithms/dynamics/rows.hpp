// Views of rows of states: one state as a row, some of many rows, one of them; and their sizes, checked.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>

#include "kalmarm/call.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

template <class View>
auto* data_of(const View& rows) {
  return rows ? rows->data() : nullptr;
}

// One state as a row.
template <class T>
RowsView<T> row(const VectorView<T>& x) {
  return {x.data(), 1, x.size()};
}
template <class T>
std::optional<RowsView<T>> row(const std::optional<VectorView<T>>& x) {
  if (!x) return {};
  return row(*x);
}
template <class T>
ForceRows<T> row(const StateForces<T>& forces) {
  return {row(forces.on), forces.axes, row(forces.loads), row(forces.gravity)};
}

template <class T>
RowsView<T> part_of(const RowsView<T>& rows, std::ptrdiff_t first, std::ptrdiff_t count,
                    std::ptrdiff_t width) {
  return {rows.data() + first * width, count, width};
}

template <class T>
std::optional<RowsView<T>> part_of(const std::optional<RowsView<T>>& rows, std::ptrdiff_t first,
                                   std::ptrdiff_t count, std::ptrdiff_t width) {
  if (!rows) return {};
  return part_of(*rows, first, count, width);
}
// forces, loads: numbers of a row.
template <class T>
ForceRows<T> part_of(const ForceRows<T>& rows, std::ptrdiff_t first, std::ptrdiff_t count,
                     std::ptrdiff_t forces, std::ptrdiff_t loads) {
  return {part_of(rows.on, first, count, forces), rows.axes,
          part_of(rows.loads, first, count, loads),
          part_of(rows.gravity, first, count, numbers_of_gravity)};
}

// Of row i alone.
template <class T>
std::optional<VectorView<T>> state_of(const std::optional<RowsView<T>>& rows, std::ptrdiff_t i,
                                      std::ptrdiff_t width) {
  if (!rows) return {};
  return VectorView<T>(rows->data() + i * width, width);
}
template <class T>
StateForces<T> state_of(const ForceRows<T>& rows, std::ptrdiff_t i, std::ptrdiff_t forces,
                        std::ptrdiff_t loads) {
  return {state_of(rows.on, i, forces), rows.axes, state_of(rows.loads, i, loads),
          state_of(rows.gravity, i, numbers_of_gravity)};
}

template <class View>
void check_size(const char* call, const char* name, const View& rows, std::ptrdiff_t count,
                std::ptrdiff_t width) {
  if (!rows.fits(count, width))
    throw std::invalid_argument(std::string(call) + ": " + name + " has size " + rows.shape() +
                                ", " + detail::shape(count, width) + " is needed");
}

template <class T>
struct Given {
  const char* name;
  RowsView<const T> rows;
  std::ptrdiff_t width;
};
template <class T>
void check_sizes(const char* call, std::ptrdiff_t count, std::initializer_list<Given<T>> all) {
  for (const auto& [name, rows, width] : all) check_size(call, name, rows, count, width);
}

}  // namespace kalmarm
