// Counts of made-up records.
#include <gtest/gtest.h>

#include <limits>

#include "accuracy/stress/tally.hpp"

namespace kalmarm::stress {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinite = std::numeric_limits<double>::infinity();

Record answer(double relative, double claimed = nan, const std::string& variant = "claims") {
  Record out{.task = "dynamics", .variant = variant};
  out.outcome.error = claimed;
  out.kS = 250;
  out.relative = out.told = relative;
  out.energy = 1;
  return out;
}

// By seeds from 1 on.
Tally counted(const std::vector<Record>& records, int most = 20) {
  Tally out({"claims"}, most);
  std::uint64_t seed = 0;
  for (const Record& record : records)
    out.add(++seed, 3e4, "float64", {.nv = 2, .records = {record}});
  return out;
}

const Group dynamics{"dynamics", "claims", "float64", "relative", 2, 4};

TEST(Tally, TellsWarningsFromSilence) {
  Record near = answer(0.25), inaccurate = answer(0.25, 0.02), refused = answer(nan);
  near.outcome.near_singular = true;
  refused.outcome.status = Outcome::Status::singular;
  const Tally tally =
      counted({answer(0), answer(1), answer(nan), answer(infinite), near, inaccurate, refused});
  const Counts& counts = tally.groups().at(dynamics);
  EXPECT_EQ(counts.status, (std::map<std::string, std::uint64_t>{{"ok", 6}, {"singular", 1}}));
  EXPECT_EQ(counts.silent.zero, 1u);
  EXPECT_EQ(counts.silent.nan, 1u);
  EXPECT_EQ(counts.silent.inf, 1u);
  EXPECT_EQ(counts.silent.bins, (std::pmr::map<int, std::uint64_t>{{0, 1}}));
  EXPECT_EQ(counts.warned.bins, (std::pmr::map<int, std::uint64_t>{{-64, 2}}));
}

TEST(Tally, CountsWhatARungAboveDoubleAnswered) {
  Record silent = answer(1), refused = answer(nan);
  silent.outcome.rung = Outcome::Rung::refined;
  refused.outcome.rung = Outcome::Rung::two_doubles;
  refused.outcome.status = Outcome::Status::singular;
  EXPECT_EQ(counted({silent, answer(1), refused}).groups().at(dynamics).recomputed, 2u);
}

TEST(Tally, CountsClaimsThatAreExceededFourfold) {
  constexpr double u = 0x1p-53;
  Record warned = answer(1, 0.02);
  EXPECT_EQ(counted({answer(4e-9, 1e-9), answer(4.1e-9, 1e-9), answer(1, 1e-3), warned,
                     answer(4 * u, 0), answer(5 * u, u / 100), answer(1), answer(nan, 1e-3)})
                .groups()
                .at(dynamics)
                .beyond_claim,
            4u);
  // none is claimed by others, or in the energy
  const Tally tally = counted({answer(1, 1e-3), answer(1, 1e-3, "estimates")});
  Group other = dynamics, energy = dynamics;
  other.variant = "estimates";
  energy.measure = "energy";
  EXPECT_FALSE(tally.groups().at(other).beyond_claim);
  EXPECT_FALSE(tally.groups().at(energy).beyond_claim);
}

TEST(Tally, ClaimsAreBesideGravity) {
  Record in_equilibrium = answer(1, 1e-9);
  in_equilibrium.told = 1e-9;
  EXPECT_EQ(counted({in_equilibrium}).groups().at(dynamics).beyond_claim, 0u);
}

TEST(Tally, TheWorstAreSilentAndInOrder) {
  Record warned = answer(9), refused = answer(9);
  warned.outcome.near_singular = true;
  refused.outcome.status = Outcome::Status::indefinite;
  std::vector<std::pair<std::uint64_t, double>> kept;
  for (const WorstCase& found :
       counted({answer(1), warned, answer(3), answer(2), answer(3), refused, answer(nan)}, 4)
           .worst())
    kept.emplace_back(found.seed, found.error);
  EXPECT_EQ(kept,
            (std::vector<std::pair<std::uint64_t, double>>{{7, infinite}, {3, 3}, {5, 3}, {4, 2}}));
}

TEST(Tally, LongChainsHaveNoEnergy) {
  Tally tally({}, 1);
  tally.add(1, 1, "float64", {.nv = largest_inverse + 1, .records = {answer(1)}});
  ASSERT_EQ(tally.groups().size(), 1u);
  EXPECT_EQ(tally.groups().begin()->first.measure, "relative");
}

TEST(Decade, IsThatOfTheDecimals) {
  EXPECT_EQ(decade(1), 0);
  EXPECT_EQ(decade(9.99), 0);
  EXPECT_EQ(decade(1000), 3);
  EXPECT_EQ(decade(std::nextafter(1000, 0)), 2);
  EXPECT_EQ(decade(0.099), -2);
  EXPECT_EQ(decade(1e-310), -310);
  EXPECT_EQ(decade(1.7e308), 308);
  for (const double x : {0.0, -1.0, infinite, nan}) EXPECT_EQ(decade(x), std::nullopt);
}

}  // namespace
}  // namespace kalmarm::stress
