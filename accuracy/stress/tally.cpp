#include "accuracy/stress/tally.hpp"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

namespace kalmarm::stress {
namespace {

constexpr std::size_t first_block = 1 << 20;  // [bytes]
constexpr double infinite = std::numeric_limits<double>::infinity();

// (1)
bool is_beyond_claim(const Record& record, double u) {
  return !std::isnan(record.outcome.error) &&
         !(record.told <= beyond * std::max(record.outcome.error, u));
}

}  // namespace

std::optional<int> decade(double x) {
  if (!(x > 0) || std::isinf(x)) return {};
  char text[32];
  const auto [end, error] =
      std::to_chars(text, text + sizeof text, x, std::chars_format::scientific);
  const char* exponent = std::find(text, end, 'e') + 1;
  int out = 0;
  std::from_chars(exponent + (*exponent == '+'), end, out);
  return out;
}

double mass_ratio(const Model<double>& model) {
  double low = infinite, high = 0;
  for (int k = 0; k < model.nv(); ++k)
    if (const double mass = model.joint(k).body.mass; mass > 0) {
      low = std::min(low, mass);
      high = std::max(high, mass);
    }
  return high > 0 ? high / low : none;
}

bool WorstCase::operator<(const WorstCase& other) const {
  return std::tie(other.error, seed, task, variant, precision) <
         std::tie(error, other.seed, other.task, other.variant, other.precision);
}

Tally::Tally(std::set<std::string> claiming, int most)
    : memory_(std::make_unique<std::pmr::monotonic_buffer_resource>(first_block)),
      claiming_(std::move(claiming)),
      most_(static_cast<std::size_t>(most)) {}

void Tally::add(std::uint64_t seed, double mass_ratio, const std::string& precision,
                const Measurement& measured) {
  const bool has_energy = measured.nv <= largest_inverse;
  for (const Record& record : measured.records) {
    Group group{record.task, record.variant,    precision,
                "relative",  decade(record.kS), decade(mass_ratio)};
    count(group, record, record.relative);
    if (record.outcome && !record.outcome.warns())
      keep({std::isnan(record.relative) ? infinite : record.relative, seed, record.task,
            record.variant, precision, record.kS, mass_ratio});
    if (!has_energy) continue;
    group.measure = "energy";
    count(group, record, record.energy);
  }
}

void Tally::count(const Group& group, const Record& record, double error) {
  Counts& counts = groups_.try_emplace(group, memory_.get()).first->second;
  ++counts.status[to_string(record.outcome.status)];
  counts.recomputed += record.outcome.rung > Outcome::Rung::float64;
  const bool claims = group.measure == "relative" && claiming_.contains(group.variant);
  if (claims && !counts.beyond_claim) counts.beyond_claim = 0;
  if (!record.outcome) return;
  const bool warns = record.outcome.warns();
  (warns ? counts.warned : counts.silent).add(error);
  const double u = group.precision == "float32" ? unit_roundoff<float>() : unit_roundoff<double>();
  if (claims && !warns && is_beyond_claim(record, u)) ++*counts.beyond_claim;
}

void Tally::keep(const WorstCase& found) {
  std::set<WorstCase>& kept = worst_[{found.task, found.variant, found.precision}];
  kept.insert(found);
  if (kept.size() > most_) kept.erase(std::prev(kept.end()));
}

std::vector<WorstCase> Tally::worst() const {
  std::set<WorstCase> all;
  for (const auto& [series, kept] : worst_) all.insert(kept.begin(), kept.end());
  return {all.begin(), all.end()};
}

}  // namespace kalmarm::stress
