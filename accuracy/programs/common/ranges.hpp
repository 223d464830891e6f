// Numbers of a command line, each within its range, and lists of values.
//
// CLI11 2.1 lets a NaN pass CLI::Range and CLI::PositiveNumber, reads -1 of an unsigned number as
// its largest, 010 as eight, and prints a bound of 1e308 with all its digits. A program's numbers
// are checked by these instead.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <type_traits>

namespace kalmarm {
namespace detail {

template <class T>
std::string short_number(T value) {
  if constexpr (std::is_integral_v<T>) return std::to_string(value);
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", static_cast<double>(value));
  return text;
}

// As CLI11 will read it; false where it does not, or takes it for another number.
template <class T>
bool read_number(const std::string& text, T& value) {
  if (!CLI::detail::lexical_cast(text, value)) return false;
  if constexpr (std::is_integral_v<T>) {
    T decimal = 0;
    const char *begin = text.data() + text.starts_with('+'), *end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(begin, end, decimal);
    return error == std::errc() && stop == end && decimal == value;
  }
  return true;
}

// Refuses what is not `is`, a test that a NaN fails: "Value -1 is not a whole number from 1 to 9".
template <class T, class Test>
CLI::Validator number_that(const Test& is, const std::string& range) {
  const std::string kind = std::is_integral_v<T> ? "whole number" : "number";
  return CLI::Validator(
      [=](const std::string& text) {
        T value{};
        if (read_number(text, value) && is(value)) return std::string();
        return "Value " + text.substr(0, 40) + " is not a " + kind + " " + range;
      },
      range);
}

}  // namespace detail

// Numbers from low to high, both included.
template <class T>
CLI::Validator between(T low, T high) {
  return detail::number_that<T>(
      [=](T value) { return value >= low && value <= high; },
      "from " + detail::short_number(low) + " to " + detail::short_number(high));
}

inline CLI::Validator positive() {
  return detail::number_that<double>([](double x) { return std::isnormal(x) && x > 0; },
                                     "above zero");
}

inline CLI::Validator not_negative() {
  return detail::number_that<double>([](double x) { return std::isfinite(x) && x >= 0; },
                                     "from zero on");
}

// A factor within which something stays.
inline CLI::Validator zero_or_above_one() {
  return detail::number_that<double>([](double x) { return x == 0 || (std::isfinite(x) && x > 1); },
                                     "that is 0 or above 1");
}

inline CLI::Validator finite() {
  return detail::number_that<double>([](double x) { return std::isfinite(x); }, "that is finite");
}

// What --seed takes in every program.
inline CLI::Validator any_seed() {
  return between<std::uint64_t>(0, std::numeric_limits<std::uint64_t>::max());
}

// What --random takes: what the states hold may need less (robots/scene/memory_limit.hpp).
inline CLI::Validator number_of_states() { return between(1, 1'000'000); }

}  // namespace kalmarm
