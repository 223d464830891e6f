#include "accuracy/stress/unit.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "robots/loader/input_error.hpp"

namespace kalmarm::stress {
namespace {

// The fewest digits that read back, as printf writes them.
std::string shortest(double value) {
  char text[32];
  for (int digits = 1; digits <= 17; ++digits) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    if (std::strtod(text, nullptr) == value) break;
  }
  return text;
}

// The whole text as a number; false where it is none.
template <class Number>
bool read(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

// What stands before the separator, which is taken off too; all of it where there is none.
std::string_view take(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view part = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

bool sweeps(const Family& family, double value) {
  const auto has = [&](const std::vector<double>& values) {
    return std::ranges::find(values, value) != values.end();
  };
  return has(family.quick) || has(family.full);
}

}  // namespace

std::string Unit::name() const {
  return family->name + '/' + shortest(value) + '/' + std::to_string(first) + '+' +
         std::to_string(count);
}

Unit unit_of(const std::string& name, const std::vector<Family>& all) {
  const auto refuse = [&](const std::string& why) {
    throw InputError("unit '" + name + "' " + why);
  };
  if (std::ranges::count(name, '/') != 2) refuse("is not FAMILY/VALUE/FIRST+COUNT");
  std::string_view rest = name;
  const std::string_view family = take(rest, '/'), value = take(rest, '/');
  const std::string_view first = take(rest, '+');
  Unit out;
  if (!read(value, out.value) || !read(first, out.first) || !read(rest, out.count))
    refuse("is not FAMILY/VALUE/FIRST+COUNT");
  if (out.count < 1 || out.first > most_seeds || out.count > most_seeds - out.first)
    refuse("has no seeds, or some above " + std::to_string(most_seeds));

  const auto found = std::ranges::find(all, family, &Family::name);
  if (found == all.end()) refuse("has an unknown family; stress --list prints them");
  out.family = &*found;
  if (!sweeps(*found, out.value)) {
    std::string values;
    for (const double known : found->full) values += (values.empty() ? "" : ", ") + shortest(known);
    refuse("has a value that its family lacks (known: " + values + ")");
  }
  return out;
}

}  // namespace kalmarm::stress
