// DoubleDouble against multi-precision: every operation is right to its last bits, also where the
// leading digits cancel.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "algorithms/fast/lowering/lowered_model.hpp"
#include "algorithms/spatial/double_double.hpp"
#include "algorithms/test/models.hpp"
#include "algorithms/test/multiprecision.hpp"

namespace kalmarm::test {
namespace {

using Mp = FixedReal<60>;

Mp exact(const DoubleDouble& x) { return Mp(x.hi) + Mp(x.lo); }

double relative(const DoubleDouble& x, const Mp& truth) {
  if (truth == 0) return x.hi == 0 && x.lo == 0 ? 0 : std::numeric_limits<double>::infinity();
  return static_cast<double>(abs((exact(x) - truth) / truth));
}

class DoubleDoubleTest : public testing::Test {
 protected:
  DoubleDouble draw() {
    std::uniform_real_distribution<double> one(1, 2), unit(-1, 1);
    const double hi = std::ldexp(one(random_), static_cast<int>(random_() % 40) - 20);
    return {random_() % 2 ? hi : -hi, hi * unit(random_) * 0x1p-53};
  }

  // Nearly a: the sum's leading digits cancel, 1 to 100 bits of them.
  DoubleDouble near(const DoubleDouble& a) {
    const double change = std::ldexp(a.hi, -1 - static_cast<int>(random_() % 100));
    return a + DoubleDouble(change);
  }

  std::mt19937_64 random_{7};
};

TEST_F(DoubleDoubleTest, EveryOperationIsRightToTheLastBits) {
  for (int i = 0; i < 10'000; ++i) {
    const DoubleDouble a = draw(), b = draw(), c = near(a);
    EXPECT_LE(relative(a * b, exact(a) * exact(b)), 0x1p-102);
    EXPECT_LE(relative(a / b, exact(a) / exact(b)), 0x1p-102);
    EXPECT_LE(relative(sqrt(abs(a)), sqrt(abs(exact(a)))), 0x1p-102);
    for (const DoubleDouble& x : {b, c, -c}) {
      EXPECT_LE(relative(a + x, exact(a) + exact(x)), 0x1p-102);
      EXPECT_LE(relative(a - x, exact(a) - exact(x)), 0x1p-102);
      EXPECT_EQ(a < x, exact(a) < exact(x));
      EXPECT_EQ(a == x, exact(a) == exact(x));
    }
  }
}

// What a pair loses: the product of what is left of a difference.
TEST_F(DoubleDoubleTest, ProductsOfDifferencesKeepTheirDigits) {
  for (int i = 0; i < 1000; ++i) {
    const DoubleDouble a = draw(), b = draw(), c = near(a), d = near(b);
    const Mp truth = (exact(a) - exact(c)) * (exact(b) - exact(d));
    EXPECT_LE(relative((a - c) * (b - d), truth), 0x1p-100);
  }
}

TEST_F(DoubleDoubleTest, IsNormalised) {
  for (int i = 0; i < 1000; ++i) {
    const DoubleDouble a = draw(), c = near(a);
    for (const DoubleDouble& x : {a + c, a - c, a * c, a / c, sqrt(abs(a))})
      EXPECT_EQ(x.hi + x.lo, x.hi);
  }
}

TEST_F(DoubleDoubleTest, SinesAndCosinesAreRight) {
  std::uniform_real_distribution<double> angle(-50, 50);
  std::vector<DoubleDouble> x(16), none(16, DoubleDouble(0)), s(16), c(16);
  std::vector<std::int64_t> quarters(16);
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = {angle(random_), angle(random_) * 0x1p-60};
    quarters[i] = static_cast<std::int64_t>(i % 4);
  }
  sin_cos(x, none, quarters, s, c);
  const Mp quarter = acos(Mp(0));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Mp turned = exact(x[i]) + Mp(quarters[i]) * quarter;
    EXPECT_LE(static_cast<double>(abs(exact(s[i]) - sin(turned))), 0x1p-101);
    EXPECT_LE(static_cast<double>(abs(exact(c[i]) - cos(turned))), 0x1p-101);
  }
}

// What rounding_bound.hpp takes for granted: sin alpha of nearly parallel axes has all its digits, and
// no angle is wrong by more than u.
TEST_F(DoubleDoubleTest, FramesOfLinksAreTurnedByTheRightAngles) {
  constexpr double u = 0x1p-102;
  for (int seed = 0; seed < 40; ++seed) {
    Random random(seed);
    const double tilt = std::pow(10, random.uniform(-12, 0));
    const auto draw = [&] { return random.uniform(-1, 1); };
    Builder builder;
    for (int k = 0; k < 10; ++k) {
      Joint<double> joint = random_joint(random, k % 3 == 2 ? k - 2 : k - 1);
      if (k % 2 == 0) joint.rotation = {draw(), tilt * draw(), tilt * draw(), draw()};
      if (k % 4 == 1) joint.rotation = {tilt * draw(), draw(), draw(), tilt * draw()};
      builder.add(joint);
    }
    const Model<double> model = builder.build();
    const LoweredModel<DoubleDouble> lowered(model.cast<DoubleDouble>());
    const LoweredModel<Mp> truth(model.cast<Mp>());
    for (int k = 0; k < model.nv(); ++k) {
      EXPECT_LE(relative(lowered.link(k).alpha.s, truth.link(k).alpha.s), u);
      EXPECT_LE(abs(exact(lowered.link(k).alpha.c) - truth.link(k).alpha.c), u);
    }
    for (int i = 0; i < lowered.angles(); ++i) {
      EXPECT_EQ(lowered.hinges().quarters[i], truth.hinges().quarters[i]);
      EXPECT_LE(abs(exact(lowered.hinges().offset[i]) - truth.hinges().offset[i]), u);
    }
  }
}

TEST_F(DoubleDoubleTest, WhatIsNoNumberStaysNone) {
  const DoubleDouble nan(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(isfinite(nan + DoubleDouble(1)));
  EXPECT_FALSE(isfinite(DoubleDouble(1) / DoubleDouble(0)));
  EXPECT_FALSE(nan > DoubleDouble(0));
  EXPECT_FALSE(nan < DoubleDouble(0));
}

}  // namespace
}  // namespace kalmarm::test
