#include <gtest/gtest.h>

#include <limits>

#include "accuracy/measures/real.hpp"
#include "accuracy/stress/error_bins.hpp"

namespace kalmarm::stress {
namespace {

// x^32 against 2^b, without rounding: 32 numbers of 53 bits make 1696 bits.
class Exactly {
 public:
  bool at_least(double x, int b) const {
    Real power = x;
    for (int i = 0; i < 5; ++i) power *= power;
    return power >= ldexp(Real(1), b);
  }

 private:
  Digits digits_{600};
};

TEST(ErrorBins, EdgesAreTheFirstDoublesOfTheirBins) {
  const Exactly exactly;
  for (int j = 1; j < bins_per_octave; ++j) {
    SCOPED_TRACE(j);
    const double edge = bin_edges[j - 1], below = std::nextafter(edge, 0);
    EXPECT_TRUE(exactly.at_least(edge, j));
    EXPECT_FALSE(exactly.at_least(below, j));
    EXPECT_EQ(bin_of(edge), j);
    EXPECT_EQ(bin_of(below), j - 1);
  }
}

TEST(ErrorBins, PowersOfTwoBeginTheirBins) {
  for (int e = -1074; e < 1024; ++e) {  // subnormal numbers too
    const double x = std::ldexp(1.0, e);
    EXPECT_EQ(bin_of(x), 32 * e);
    if (e > -1022) {
      EXPECT_EQ(bin_of(std::nextafter(x, 0)), 32 * e - 1);
    }
  }
  EXPECT_EQ(bin_of(std::numeric_limits<double>::max()), 32 * 1024 - 1);
}

TEST(ErrorBins, SubnormalNumbersAreAsExact) {
  const double least = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(bin_of(3 * least), 32 * -1073 + 18);  // log2 1.5 = 18.7 / 32
  EXPECT_EQ(bin_of(5 * least), 32 * -1072 + 10);  // log2 1.25 = 10.3 / 32
}

TEST(ErrorBins, WhatIsNoPositiveNumberHasItsOwnCount) {
  ErrorCounts counts;
  for (const double error : {0.0, -0.0, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN(), 1.0, 1.01, 1.03})
    counts.add(error);
  EXPECT_EQ(counts.zero, 2u);
  EXPECT_EQ(counts.inf, 1u);
  EXPECT_EQ(counts.nan, 1u);
  EXPECT_EQ(counts.bins, (std::pmr::map<int, std::uint64_t>{{0, 2}, {1, 1}}));
}

}  // namespace
}  // namespace kalmarm::stress
