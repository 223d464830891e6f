// Forces from outside, or rows of contacts, loads and gravity among the arguments of a call.
#pragma once

#include <algorithm>
#include <array>
#include <initializer_list>
#include <kalmarm/call.hpp>
#include <kalmarm/dynamics.hpp>
#include <span>
#include <string>

#include "arrays.hpp"

namespace kalmarm::python {

// Throws ValueError with the call.
inline Axes axes_of(const char* call, const std::string& name) {
  if (name == "local") return Axes::local;
  if (name == "world") return Axes::world;
  if (name == "aligned") return Axes::aligned;
  throw nb::value_error(
      (std::string(call) + ": axes '" + name + "' is unknown: local, world, aligned").c_str());
}

// What a call may be given on frames: its name, and what it is called where a robot has no such frames.
struct OfFrames {
  const char* name;
  const char* of_none;
};
constexpr OfFrames forces_argument{"forces", "forces (of a robot without acted_on)"};
constexpr OfFrames contacts_argument{"contacts", "contacts (of a robot without contacts)"};
constexpr OfFrames loads_argument{"loads", "loads (of a robot without loaded)"};

// The arguments of a call, and after them forces or contacts, loads and gravity, where they are given; widths: their
// numbers of a state.
class WithForces {
 public:
  WithForces(const char* call, std::span<const Argument> arguments, nb::handle forces, int width,
             const std::string& axes, nb::handle loads, int loads_width,
             nb::handle gravity = nb::none(), const OfFrames& what = forces_argument)
      : count_(static_cast<int>(arguments.size())), axes_(axes_of(call, axes)) {
    std::copy(arguments.begin(), arguments.end(), all_.begin());
    on_ = add(forces, width, what);
    loads_ = add(loads, loads_width, loads_argument);
    gravity_ = add(gravity, numbers_of_gravity, {"gravity", ""});
  }
  WithForces(const char* call, std::initializer_list<Argument> arguments, nb::handle forces,
             int width, const std::string& axes, nb::handle loads, int loads_width,
             nb::handle gravity = nb::none(), const OfFrames& what = forces_argument)
      : WithForces(call, std::span(arguments.begin(), arguments.size()), forces, width, axes, loads,
                   loads_width, gravity, what) {}

  std::span<const Argument> all() const { return {all_.data(), std::size_t(count_)}; }

  template <class T>
  StateForces<T> of_state(const Inputs& in, std::ptrdiff_t row = 0) const {
    StateForces<T> out{.axes = axes_};
    if (on_.given()) out.on.emplace(vector<T>(in, on_.at, row, on_.width));
    if (loads_.given()) out.loads.emplace(vector<T>(in, loads_.at, row, loads_.width));
    if (gravity_.given()) out.gravity.emplace(vector<T>(in, gravity_.at, row, gravity_.width));
    return out;
  }
  template <class T>
  ForceRows<T> of_rows(const Inputs& in) const {
    ForceRows<T> out{.axes = axes_};
    if (on_.given()) out.on.emplace(rows_of<T>(in, on_.at, on_.width));
    if (loads_.given()) out.loads.emplace(rows_of<T>(in, loads_.at, loads_.width));
    if (gravity_.given()) out.gravity.emplace(rows_of<T>(in, gravity_.at, gravity_.width));
    return out;
  }

 private:
  struct Place {
    int at = -1, width = 0;  // among the arguments

    bool given() const { return at >= 0; }
  };

  Place add(nb::handle value, int width, const OfFrames& what) {
    if (value.is_none()) return {};
    all_.at(count_) = {width > 0 ? what.name : what.of_none, value, width};
    return {count_++, width};
  }

  std::array<Argument, Inputs::most_arguments> all_;
  int count_;
  Axes axes_;
  Place on_, loads_, gravity_;
};

}  // namespace kalmarm::python
