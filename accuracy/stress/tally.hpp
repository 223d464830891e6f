// Counts of what answers showed, instead of their records: memory and files are those of the
// groups, however many the mechanisms, and counts of parts add up to those of the whole.
//
// A group is a task, variant, precision, measure of the error (relative, or energy), and the
// decades of kS and of the mass ratio, heaviest over lightest body. It counts outcomes by status,
// and errors in bins (error_bins.hpp) of answers that are ok: silent or warned, by Outcome::warns().
//
//   recomputed     outcomes of the fast path that a rung above double gave, whether double's own answer
//                  was right or not: Outcome::rung
//   beyond_claim   silent answers of variants that claim an error, the refined ones, with
//                    error > 4 max(claim, u)                                               (1)
//                  both as Outcome::error tells them. A claim below u counts as u, to which the
//                  answer is rounded
//   worst          of a task, variant and precision the silent answers with the largest relative
//                  error, then the smallest seed. One that is no number is infinite
//
// Energies are counted where M is known (largest_inverse).
#pragma once

#include <compare>
#include <cstddef>
#include <map>
#include <memory>
#include <memory_resource>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "accuracy/stress/error_bins.hpp"
#include "accuracy/stress/measure_case.hpp"

namespace kalmarm::stress {

inline constexpr double beyond = 4;  // (1)

// floor(log10 x), by the decimals of x; nothing of what is no positive number.
std::optional<int> decade(double x);

// NaN where no body has a mass.
double mass_ratio(const Model<double>& model);

struct Group {
  std::string task, variant, precision, measure;
  std::optional<int> kS, mass_ratio;  // decades

  auto operator<=>(const Group&) const = default;
};

struct Counts {
  std::map<std::string, std::uint64_t> status;
  std::uint64_t recomputed = 0;
  ErrorCounts silent, warned;
  std::optional<std::uint64_t> beyond_claim;  // empty: nothing is claimed

  explicit Counts(std::pmr::memory_resource* memory) : silent(memory), warned(memory) {}
};

struct WorstCase {
  double error;
  std::uint64_t seed;
  std::string task, variant, precision;
  double kS, mass_ratio;  // NaN: not known

  // The largest error first.
  bool operator<(const WorstCase& other) const;
};

class Tally {
 public:
  // claiming: variants of which errors are claims. most: cases kept of each series.
  Tally(std::set<std::string> claiming, int most);

  // Of one mechanism.
  void add(std::uint64_t seed, double mass_ratio, const std::string& precision,
           const Measurement& measured);

  // A mechanism that counts in nothing else, for lack of truth.
  void leave_out(const std::string& why) { ++left_out_[why]; }

  const std::map<Group, Counts>& groups() const { return groups_; }
  const std::map<std::string, std::uint64_t>& left_out() const { return left_out_; }
  std::vector<WorstCase> worst() const;  // of all series, in order

 private:
  void count(const Group& group, const Record& record, double error);
  void keep(const WorstCase& found);

  // Of all bins, in large blocks: glibc's malloc takes ten times the memory where small blocks that
  // stay are among those of mechanisms, which come and go.
  std::unique_ptr<std::pmr::monotonic_buffer_resource> memory_;
  std::set<std::string> claiming_;
  std::size_t most_;
  std::map<Group, Counts> groups_;
  std::map<std::string, std::uint64_t> left_out_;
  std::map<std::vector<std::string>, std::set<WorstCase>> worst_;  // by task, variant, precision
};

}  // namespace kalmarm::stress
