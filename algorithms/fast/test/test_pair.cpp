// Pairs against multi-precision: what they compute is right to about twice the digits of double, in
// one number and in every lane.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "algorithms/spatial/pair_sincos.hpp"
#include "algorithms/test/multiprecision.hpp"

namespace kalmarm::test {
namespace {

using Mp = FixedReal<60>;

Mp exact(const Pair<double>& x) { return Mp(x.hi) + Mp(x.lo); }

double relative(const Pair<double>& x, const Mp& truth) {
  return static_cast<double>(abs((exact(x) - truth) / truth));
}

class PairTest : public testing::Test {
 protected:
  // hi of any size, lo of its rounding's.
  Pair<double> draw() {
    std::uniform_real_distribution<double> one(1, 2), unit(-1, 1);
    const double hi = std::ldexp(one(random_), static_cast<int>(random_() % 40) - 20);
    return {random_() % 2 ? hi : -hi, hi * unit(random_) * 0x1p-53};
  }

  std::mt19937_64 random_{7};
};

TEST_F(PairTest, ArithmeticIsRightToTwiceTheDigits) {
  for (int i = 0; i < 10'000; ++i) {
    const Pair<double> a = draw(), b = draw();
    EXPECT_LE(relative(a * b, exact(a) * exact(b)), 0x1p-103);
    EXPECT_LE(relative(a / b, exact(a) / exact(b)), 0x1p-102);
    EXPECT_LE(relative(sqrt(abs(a)), sqrt(abs(exact(a)))), 0x1p-102);
    // Of a sum, relative to what it is the sum of.
    const Mp size = abs(exact(a)) + abs(exact(b));
    EXPECT_LE(static_cast<double>(abs(exact(a + b) - (exact(a) + exact(b))) / size), 0x1p-104);
    EXPECT_LE(static_cast<double>(abs(exact(a - b) - (exact(a) - exact(b))) / size), 0x1p-104);
    EXPECT_EQ(a < b, exact(a) < exact(b));
  }
}

// A long sum that cancels: what a double loses the pair keeps.
TEST_F(PairTest, CancellationLosesDigitsOfThePairAlone) {
  Pair<double> sum = 0.0;
  Mp truth = 0;
  double plain = 0;
  for (int i = 0; i < 1000; ++i) {
    const Pair<double> x = draw() * draw();
    for (const Pair<double>& term : {x, -(x * Pair<double>(1 + 0x1p-20))}) {
      sum += term;
      truth += exact(term);
      plain += term.hi;
    }
  }
  EXPECT_LE(relative(sum, truth), 1e-20);
  EXPECT_GE(relative(Pair<double>(plain), truth), 1e-14);
}

TEST_F(PairTest, EveryLaneIsAsOneNumber) {
  using P = WidePack<double>;
  constexpr int lanes = Lanes<P>::count;
  Pair<double> a[lanes], b[lanes];
  Pair<P> A, B;
  for (int i = 0; i < lanes; ++i) {
    a[i] = draw();
    b[i] = draw();
    A.hi.set(i, a[i].hi);
    A.lo.set(i, a[i].lo);
    B.hi.set(i, b[i].hi);
    B.lo.set(i, b[i].lo);
  }
  const auto expect_equal = [&](const Pair<P>& X, const auto& of) {
    for (int i = 0; i < lanes; ++i) {
      const Pair<double> x = of(a[i], b[i]);
      EXPECT_EQ(X.hi[i], x.hi);
      EXPECT_EQ(X.lo[i], x.lo);
    }
  };
  expect_equal(A + B, [](auto x, auto y) { return x + y; });
  expect_equal(A - B, [](auto x, auto y) { return x - y; });
  expect_equal(A * B, [](auto x, auto y) { return x * y; });
  expect_equal(A / B, [](auto x, auto y) { return x / y; });
}

TEST_F(PairTest, SineAndCosine) {
  using P = WidePack<double>;
  std::uniform_real_distribution<double> unit(-1, 1);
  double worst = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double range = i % 4 == 0 ? 1e6 : i % 4 == 1 ? 10 : i % 4 == 2 ? 1 : 1e-9;
    double hi = range * unit(random_);
    if (i % 7 == 0) hi = std::numbers::pi / 4 * static_cast<double>(i % 64 - 32);
    const Pair<double> x = {hi, 0x1p-53 * hi * unit(random_)};
    const int quarters = i % 4;
    Pair<P> s, c;
    sin_cos(Pair<P>(x), quarters - typename P::Mask{}, s, c);
    const Mp angle = exact(x) + quarters * acos(Mp(0));
    for (const auto& [found, truth] : {std::pair{s, Mp(sin(angle))}, {c, Mp(cos(angle))}})
      worst = std::max(worst, static_cast<double>(abs(exact({found.hi[0], found.lo[0]}) - truth)));
  }
  EXPECT_LE(worst, 0x1p-102);
  Pair<P> s, c;
  sin_cos(Pair<P>(P(std::numeric_limits<double>::infinity())), typename P::Mask{}, s, c);
  EXPECT_TRUE(std::isnan(s.hi[0] + s.lo[0]));
}

TEST_F(PairTest, AngleOfAPoint) {
  for (int i = 0; i < 1000; ++i) {
    const Pair<double> x = draw(), y = draw();
    EXPECT_LE(static_cast<double>(abs(exact(atan2(y, x)) - atan2(exact(y), exact(x)))), 0x1p-100);
  }
}

}  // namespace
}  // namespace kalmarm::test
