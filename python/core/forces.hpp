// Forces from outside, or rows of contacts, among the arguments of a call.
#pragma once

#include <algorithm>
#include <array>
#include <initializer_list>
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

// The arguments of a call, and after them these, of `width` numbers a state, where they are given.
class WithForces {
 public:
  WithForces(const char* call, std::span<const Argument> arguments, nb::handle forces, int width,
             const std::string& axes, const OfFrames& what = forces_argument)
      : arguments_(static_cast<int>(arguments.size())),
        width_(width),
        given_(!forces.is_none()),
        axes_(axes_of(call, axes)) {
    std::copy(arguments.begin(), arguments.end(), all_.begin());
    if (given_) all_[arguments_] = {width > 0 ? what.name : what.of_none, forces, width};
  }
  WithForces(const char* call, std::initializer_list<Argument> arguments, nb::handle forces,
             int width, const std::string& axes, const OfFrames& what = forces_argument)
      : WithForces(call, std::span(arguments.begin(), arguments.size()), forces, width, axes,
                   what) {}

  std::span<const Argument> all() const { return {all_.data(), std::size_t(arguments_ + given_)}; }

  template <class T>
  StateForces<T> of_state(const Inputs& in, std::ptrdiff_t row = 0) const {
    StateForces<T> out{.axes = axes_};
    if (given_) out.on.emplace(vector<T>(in, arguments_, row, width_));
    return out;
  }
  template <class T>
  ForceRows<T> of_rows(const Inputs& in) const {
    ForceRows<T> out{.axes = axes_};
    if (given_) out.on.emplace(rows_of<T>(in, arguments_, width_));
    return out;
  }

 private:
  std::array<Argument, 7> all_;  // a step's q, qd, tau and gains before them
  int arguments_, width_;
  bool given_;
  Axes axes_;
};

}  // namespace kalmarm::python
