// A graph folds what is known, holds an operation once, and works out what was recorded.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "algorithms/generate/graph.hpp"
#include "algorithms/generate/recorded.hpp"

namespace kalmarm::test {
namespace {

class GraphOf : public testing::Test {
 protected:
  Graph graph;
  const int x = graph.input(), y = graph.input();
  const int zero = graph.constant(0), one = graph.constant(1);
};

TEST_F(GraphOf, ZerosAndOnesCostNothing) {
  EXPECT_EQ(graph.add(x, zero), x);
  EXPECT_EQ(graph.add(zero, x), x);
  EXPECT_EQ(graph.subtract(x, zero), x);
  EXPECT_EQ(graph.subtract(x, x), zero);
  EXPECT_EQ(graph.multiply(x, zero), zero);
  EXPECT_EQ(graph.multiply(one, x), x);
  EXPECT_EQ(graph.divide(x, one), x);
  EXPECT_EQ(graph.divide(zero, x), zero);
  EXPECT_EQ(graph.constant(-0.0), zero);
}

TEST_F(GraphOf, SignsMoveOutwards) {
  const int xy = graph.multiply(x, y), minus_x = graph.negate(x), minus_y = graph.negate(y);
  EXPECT_EQ(graph.multiply(minus_x, minus_y), xy);
  EXPECT_EQ(graph.multiply(minus_x, y), graph.negate(xy));
  EXPECT_EQ(graph.multiply(graph.constant(-1), x), minus_x);
  EXPECT_EQ(graph.add(x, minus_y), graph.subtract(x, y));
  EXPECT_EQ(graph.add(minus_x, y), graph.subtract(y, x));
  EXPECT_EQ(graph.subtract(x, minus_y), graph.add(x, y));
  EXPECT_EQ(graph.negate(graph.subtract(x, y)), graph.subtract(y, x));
  EXPECT_EQ(graph.negate(minus_x), x);
}

TEST_F(GraphOf, ASignThatIsKnownCostsNothing) {
  EXPECT_EQ(graph.with_sign(x, one), x);
  EXPECT_EQ(graph.with_sign(x, zero), graph.negate(x));
  const std::array outputs = {graph.with_sign(x, y)};
  for (const double sign : {1.0, 0.0, -1.0}) {
    const std::array inputs = {3.0, sign};
    EXPECT_EQ(graph.evaluate<double>(outputs, inputs)[0], sign > 0 ? 3 : -3);
  }
}

TEST_F(GraphOf, TheSameOperationStandsOnce) {
  EXPECT_EQ(graph.add(x, y), graph.add(y, x));
  EXPECT_EQ(graph.multiply(x, y), graph.multiply(y, x));
  EXPECT_NE(graph.subtract(x, y), graph.subtract(y, x));
  EXPECT_NE(graph.divide(x, y), graph.divide(y, x));
  EXPECT_NE(graph.minimum(x, y), graph.minimum(y, x));  // of a NaN they differ
}

TEST_F(GraphOf, WhatNoOutputNeedsIsNotCounted) {
  const int sum = graph.add(x, y), product = graph.multiply(sum, y);
  graph.divide(product, x);
  const std::array outputs = {sum};
  EXPECT_EQ(graph.count(outputs).flops(), 1);
  EXPECT_EQ(graph.uses(outputs)[product], 0);
  EXPECT_EQ(graph.uses(outputs)[sum], 1);
}

// Of every operation, in float too.
TEST(Recorded, GivesWhatItsNumbersWouldGive) {
  const auto f = []<class T>(const T& x, const T& y) {
    using std::min, std::sqrt;
    T s, c;
    if constexpr (std::is_same_v<T, Recorded>) {
      sin_cos(x, T(0.25), s, c);
    } else {
      s = std::sin(x + T(0.25));
      c = std::cos(x + T(0.25));
    }
    T z = x * y - s / y;
    z += sqrt(y) * T(3);
    z -= min(x, T(-c));
    return T(-z);
  };
  Graph graph;
  int result;
  {
    const Recording recording(graph);
    const Recorded x = Recorded::input(), y = Recorded::input();
    result = (f(x, y) + zero_where_less(x, y, y) * 2.0).node();
  }
  const std::array outputs = {result};
  for (const double x : {-0.75, 2.5}) {
    constexpr double y = 1.5;
    const std::array inputs = {x, y};
    const std::array narrow = {static_cast<float>(x), static_cast<float>(y)};
    const double kept = x < y ? 0 : 2 * y;
    EXPECT_DOUBLE_EQ(graph.evaluate<double>(outputs, inputs)[0], f(x, y) + kept);
    EXPECT_FLOAT_EQ(graph.evaluate<float>(outputs, narrow)[0],
                    f(narrow[0], narrow[1]) + static_cast<float>(kept));
  }
}

}  // namespace
}  // namespace kalmarm::test
