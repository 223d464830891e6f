// Packs of SIMD lanes, of a register and wider ones: sine and cosine, the reciprocal, sums over
// lanes, and rows that are turned into lanes and back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "algorithms/spatial/lanes.hpp"
#include "algorithms/spatial/sincos.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

// Error in units in the last place, against a wider type.
template <class S, class Wide>
double sin_cos_error(double range) {
  constexpr int n = padding<S>;
  Random random(17);
  double worst = 0;
  const auto ulps = [](S got, Wide exact) {
    int exponent;
    std::frexp(exact, &exponent);
    const int digits = std::numeric_limits<S>::digits;
    return static_cast<double>(std::abs(std::ldexp(Wide(got) - exact, digits - exponent)));
  };
  for (int i = 0; i < 20000; ++i) {
    S x[n];
    for (S& angle : x) {
      angle = S(random.uniform(-range, range));
      if (i % 2 == 0)  // next to a multiple of pi/2
        angle = S(std::round(angle / (std::numbers::pi / 2)) * (std::numbers::pi / 2)) *
                (1 + random.below(3) * std::numeric_limits<S>::epsilon());
    }
    Pack<S, n> sine, cosine;
    sin_cos(Pack<S, n>::load(x), sine, cosine);
    for (int l = 0; l < n; ++l) {
      if (x[l] == S(0)) continue;
      worst = std::max(worst, ulps(sine[l], std::sin(Wide(x[l]))));
      worst = std::max(worst, ulps(cosine[l], std::cos(Wide(x[l]))));
    }
  }
  return worst;
}

TEST(SinCos, IsWithinItsUlps) {
  for (double range : {0.8, 3.2, 100.0, 1.2e4}) {
    const double float32 = sin_cos_error<float, double>(range);
    const double float64 = sin_cos_error<double, long double>(range);
    EXPECT_LE(float32, 1.1) << range;
    EXPECT_LE(float64, 1.1) << range;
  }
  const double farther = sin_cos_error<double, long double>(1e6);
  EXPECT_LE(farther, 1.1);
}

template <class T>
class Packs : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Packs, Precisions);

TYPED_TEST(Packs, ReciprocalIsWithinTwoUnitsInTheLastPlace) {
  using T = TypeParam;
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const T d(static_cast<T>(std::exp2(random.uniform(-100, 100))));
    const T exact = T(1) / d;
    EXPECT_LE(std::abs(reciprocal(WidePack<T>(d))[0] - exact), 4 * unit_roundoff<T>() * exact) << d;
  }
}

TEST(SinCos, ZeroIsExactAndNanIsKept) {
  WidePack<double> s, c;
  sin_cos(WidePack<double>(0.0), s, c);
  EXPECT_EQ(s[0], 0);
  EXPECT_EQ(c[0], 1);
  for (double x :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    sin_cos(WidePack<double>(x), s, c);
    EXPECT_TRUE(std::isnan(s[0]) && std::isnan(c[0])) << x;
  }
}

template <class S, int registers>
using PackOf = Pack<S, registers * Lanes<WidePack<S>>::count>;

template <class P>
class PacksOfRegisters : public testing::Test {};

using OneToFourRegisters = testing::Types<PackOf<float, 1>, PackOf<double, 1>, PackOf<float, 2>,
                                          PackOf<double, 2>, PackOf<float, 4>, PackOf<double, 4>>;
TYPED_TEST_SUITE(PacksOfRegisters, OneToFourRegisters);

// Lane i of row r: n r + i + 1.
template <class P>
P numbered(int row = 0) {
  constexpr int n = Lanes<P>::count;
  P out;
  for (int i = 0; i < n; ++i) out.set(i, typename Lanes<P>::Scalar(n * row + i + 1));
  return out;
}

TYPED_TEST(PacksOfRegisters, TransposeSwapsRowsAndLanes) {
  constexpr int n = Lanes<TypeParam>::count;
  TypeParam rows[n];
  for (int i = 0; i < n; ++i) rows[i] = numbered<TypeParam>(i);
  transpose(rows);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) ASSERT_EQ(rows[i][j], n * j + i + 1) << i << ", " << j;
}

TYPED_TEST(PacksOfRegisters, RunningSumsAreThoseOfTheLanesBefore) {
  const TypeParam sums = running_sum(numbered<TypeParam>());
  for (int i = 0; i < Lanes<TypeParam>::count; ++i) EXPECT_EQ(sums[i], (i + 1) * (i + 2) / 2);
}

TYPED_TEST(PacksOfRegisters, FirstLanesAreReadAndNothingBehindThem) {
  using T = typename Lanes<TypeParam>::Scalar;
  constexpr int n = Lanes<TypeParam>::count;
  for (int count = 1; count <= n; ++count) {
    std::vector<T> numbers(count);  // of its own length: the address sanitizer watches its end
    for (int i = 0; i < count; ++i) numbers[i] = T(i + 1);
    const auto lanes = load_first<TypeParam>(numbers.data(), count);
    for (int i = 0; i < n; ++i) EXPECT_EQ(lanes[i], i < count ? T(i + 1) : T(0));
  }
}

TYPED_TEST(PacksOfRegisters, ArithmeticIsThatOfEachLane) {
  using T = typename Lanes<TypeParam>::Scalar;
  const auto a = numbered<TypeParam>(), b = numbered<TypeParam>(3);
  TypeParam sum = a;
  sum += b;
  for (int i = 0; i < Lanes<TypeParam>::count; ++i) {
    EXPECT_EQ(sum[i], a[i] + b[i]);
    EXPECT_EQ((a - b)[i], a[i] - b[i]);
    EXPECT_EQ((a * b)[i], a[i] * b[i]);
    EXPECT_EQ((a / b)[i], a[i] / b[i]);
    EXPECT_EQ((-a)[i], -a[i]);
    EXPECT_EQ(min(a, TypeParam(T(5)))[i], std::min(a[i], T(5)));
  }
}

// A pack of half the width stands for either half.
TYPED_TEST(Packs, OfTwiceTheWidthTakeANumberOfEveryLaneTwice) {
  using T = TypeParam;
  const auto one = numbered<PackOf<T, 1>>();
  const auto two = numbered<PackOf<T, 2>>(3);
  constexpr int n = Lanes<PackOf<T, 1>>::count;
  for (int i = 0; i < 2 * n; ++i) {
    EXPECT_EQ((one * two)[i], one[i % n] * two[i]);
    EXPECT_EQ((two - one)[i], two[i] - one[i % n]);
    EXPECT_EQ((PackOf<T, 2>(one))[i], one[i % n]);
  }
}

TYPED_TEST(PacksOfRegisters, SineAndCosineAreThoseOfOneRegister) {
  using T = typename Lanes<TypeParam>::Scalar;
  using Register = WidePack<T>;
  constexpr int n = Lanes<TypeParam>::count, lanes = Lanes<Register>::count;
  Random random(3);
  T x[n];
  for (T& angle : x) angle = T(random.uniform(-4, 4));
  TypeParam sine, cosine;
  sin_cos(TypeParam::load(x), sine, cosine);
  for (int i = 0; i < n; ++i) {
    Register s, c;
    sin_cos(Register::load(x + i / lanes * lanes), s, c);
    EXPECT_EQ(sine[i], s[i % lanes]);
    EXPECT_EQ(cosine[i], c[i % lanes]);
    EXPECT_EQ(piece<lanes>(sine, i / lanes)[i % lanes], sine[i]);
  }
}

TYPED_TEST(PacksOfRegisters, TinyNumbersBecomeZeroInTheirLanesAlone) {
  using T = typename Lanes<TypeParam>::Scalar;
  for (int tiny = 0; tiny < Lanes<TypeParam>::count; ++tiny)
    for (const T sign : {T(-1), T(1)}) {
      auto x = numbered<TypeParam>();
      x.set(tiny, sign * std::numeric_limits<T>::min());
      const TypeParam kept = without_tiny(x);
      for (int i = 0; i < Lanes<TypeParam>::count; ++i)
        EXPECT_EQ(kept[i], i == tiny ? T(0) : T(i + 1));
    }
}

// In tiles, in a last tile that overlaps, in rows shorter than a tile, and where rows are missing.
TYPED_TEST(Packs, RowsOfEveryWidthAndCountComeBackAndNothingElseIsWritten) {
  using T = TypeParam;
  constexpr int n = padding<T>, guard = 2 * n;
  for (int width = 1; width <= 3 * n + 1; ++width)
    for (int states = 1; states <= n; ++states)
      for (const int behind : {0, 1, n}) {  // rows that follow in the same array
        std::vector<T> rows((states + behind) * width), out(states * width + guard, T(-77));
        for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = T(i + 1);
        std::vector<Pack<T, n>> packs(width);
        to_lanes(rows.data(), width, states, states + behind, packs);
        for (int j = 0; j < width; ++j)
          for (int i = 0; i < n; ++i)
            ASSERT_EQ(packs[j][i], rows[std::min(i, states - 1) * width + j]) << width;
        from_lanes(packs, width, states, out.data());
        ASSERT_TRUE(std::equal(out.begin(), out.begin() + states * width, rows.begin()))
            << width << ", " << states << " states";
        for (int i = 0; i < guard; ++i) ASSERT_EQ(out[states * width + i], T(-77));
      }
}

}  // namespace
}  // namespace kalmarm::test
