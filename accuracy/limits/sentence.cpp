#include "accuracy/limits/sentence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace kalmarm::limits {
namespace {

constexpr int fewest_digits = 3;

// As in Found::tallies.
constexpr int precision_step = static_cast<int>(variants.size());
constexpr int default_float32 = 0, default_float64 = precision_step,
              last_bits_float64 = 2 * precision_step - 1;
constexpr std::array in_order = {default_float32, default_float64, last_bits_float64};

bool is_float32(int contender) { return contender < precision_step; }

int most_digits(int contender) { return is_float32(contender) ? 5 : 9; }

std::string name(int contender) {
  return contender == default_float32   ? "float32"
         : contender == default_float64 ? "float64"
                                        : "float64 to the last bits";
}

std::string digits_text(int digits) {
  return std::to_string(digits) + (digits == 1 ? " digit" : " digits");
}

int digits_everywhere(const std::vector<const Swept*>& all, int contender) {
  int out = 99;
  for (const Swept* swept : all)
    for (std::size_t i = 0; i < swept->values.size(); ++i)
      out = std::min(out, digits_kept(*swept, i, contender));
  return out;
}

std::string with_value(const std::string& range, double value) {
  std::string out = range;
  return out.replace(out.find("{}"), 2, short_value(value));
}

// "a, b and c"
std::string listed(const std::vector<std::string>& parts) {
  std::string out;
  for (std::size_t i = 0; i < parts.size(); ++i)
    out += (i == 0 ? "" : i + 1 == parts.size() ? " and " : ", ") + parts[i];
  return out;
}

// 3 of the rule. hard: the robot as given, and the stresses that are limits.
std::string beyond(const std::vector<const Swept*>& all, const std::vector<const Swept*>& hard,
                   const Promise& promise) {
  const auto better = std::ranges::find_if(in_order, [&](int contender) {
    return contender > promise.contender && digits_everywhere(hard, contender) >= promise.digits;
  });
  if (better == in_order.end()) return "; beyond that no form is right to as many";
  const std::string out = "; beyond that take " + name(*better);
  const int wide = digits_everywhere(all, default_float64);
  if (*better != default_float64 || wide < promise.digits) return out;
  return out + ", right to " + digits_text(wide) + " in all that was searched";
}

}  // namespace

int digits_kept(const Swept& swept, std::size_t value, int contender) {
  double worst = 0;
  for (const std::vector<Found>& found : swept.found) {
    const Tally& tally = found[value].tallies[contender];
    if (tally.refused > 0 || tally.worst < 0) return 0;
    worst = std::max(worst, tally.worst);
  }
  return std::max(0, static_cast<int>(std::floor(-std::log10(std::max(worst, 1e-20)))));
}

Promise promise_of(const Swept& given) {
  for (const int contender : in_order)
    if (const int digits = digits_kept(given, 0, contender); digits >= fewest_digits)
      return {contender, std::min(digits, most_digits(contender))};
  return {};
}

std::size_t values_kept(const Swept& swept, const Promise& promise) {
  std::size_t kept = 0;
  while (kept < swept.values.size() && promise.contender >= 0 &&
         digits_kept(swept, kept, promise.contender) >= promise.digits)
    ++kept;
  return kept;
}

std::string sentence_of(const std::vector<Swept>& swept) {
  const Promise promise = promise_of(swept[0]);
  if (promise.contender < 0)
    return "even as given, no form is right to " + digits_text(fewest_digits) +
           " in every pose searched";
  std::vector<const Swept*> all, hard = {&swept[0]};
  std::vector<std::string> holds, fails, told;
  for (const Swept& one : swept) {
    all.push_back(&one);
    const std::size_t kept = values_kept(one, promise);
    if (kept == one.values.size()) {
      if (one.stress.told) told.push_back(", " + with_value(one.stress.range, one.values.back()));
      continue;
    }
    hard.push_back(&one);
    (kept == 0 ? fails : holds)
        .push_back(with_value(one.stress.range, one.values[kept == 0 ? 0 : kept - 1]));
  }

  std::string out;
  if (promise.contender != default_float32)
    out = "float32 keeps " + digits_text(digits_kept(swept[0], 0, default_float32)) +
          " of the robot as given; ";
  out += name(promise.contender) + " is right to " + digits_text(promise.digits);
  std::string never;  // a limit
  for (const std::string& stress : told) never += stress;
  if (hard.size() == 1) return out + " in every pose and under every stress searched" + never;
  out += " in every pose searched";
  if (!holds.empty()) out += ", " + listed(holds);
  out += never;
  if (!fails.empty()) out += ", but not " + listed(fails);
  return out + beyond(all, hard, promise);
}

}  // namespace kalmarm::limits
