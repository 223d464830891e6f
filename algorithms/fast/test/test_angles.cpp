// Sines and cosines of angles of any size, in every kind of number that the sweeps compute with,
// against multi-precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "algorithms/spatial/double_double.hpp"
#include "algorithms/test/models.hpp"
#include "algorithms/test/multiprecision.hpp"

namespace kalmarm::test {
namespace {

using Mp = FixedReal<700>;  // holds the sum of any two doubles

// What an array of T has in a lane, as numbers of double: one of them, or hi and lo.
template <class T>
struct Numbers {
  using Scalar = typename Lanes<T>::Scalar;
  static constexpr int lanes = Lanes<T>::count;
  static constexpr bool of_two = false;
  static void set(T& x, int lane, double hi, double) {
    if constexpr (lanes == 1)
      x = static_cast<T>(hi);
    else
      x.set(lane, static_cast<Scalar>(hi));
  }
  static Mp get(const T& x, int lane) {
    if constexpr (lanes == 1)
      return Mp(x);
    else
      return Mp(x[lane]);
  }
};

template <class P>
struct Numbers<Pair<P>> {
  using Scalar = Pair<double>;
  static constexpr int lanes = Lanes<P>::count;
  static constexpr bool of_two = true;
  static void set(Pair<P>& x, int lane, double hi, double lo) {
    Numbers<P>::set(x.hi, lane, hi, 0);
    Numbers<P>::set(x.lo, lane, lo, 0);
  }
  static Mp get(const Pair<P>& x, int lane) {
    return Numbers<P>::get(x.hi, lane) + Numbers<P>::get(x.lo, lane);
  }
};

template <>
struct Numbers<DoubleDouble> : Numbers<Pair<double>> {
  using Scalar = DoubleDouble;
  static void set(DoubleDouble& x, int, double hi, double lo) { x = {hi, lo}; }
  static Mp get(const DoubleDouble& x, int) { return Mp(x.hi) + Mp(x.lo); }
};

template <class T>
class Angles : public testing::Test {
 protected:
  using N = Numbers<T>;
  using S = typename N::Scalar;
  static constexpr bool in_float = std::is_same_v<S, float>;
  using Given = std::conditional_t<in_float, float, double>;

  // Of a size up to the largest, drawn by its logarithm; every other one next to a multiple of pi/2.
  Given draw() {
    const double largest = in_float ? 38 : 300;
    double x = std::pow(10, random_.uniform(-largest, largest)) * (random_.chance(0.5) ? 1 : -1);
    if (random_.chance(0.5)) {
      static const Mp quarter = acos(Mp(0));
      x = static_cast<double>(Mp(round(Mp(Mp(x) / quarter)) * quarter));
    }
    return static_cast<Given>(x);
  }

  // The worst error of sines and cosines of x + offset and quarters of a turn, in what is allowed.
  void expect_right(const std::vector<double>& x, const std::vector<double>& offset) {
    constexpr int blocks = 3, each = padding<T> * N::lanes;
    ASSERT_EQ(x.size(), std::size_t(blocks * each));
    std::vector<T> angle(blocks * padding<T>, T(S(0))), s = angle, c = angle;
    std::vector<S> added(angle.size());
    std::vector<IntegerOf<Given>> quarters(angle.size());
    const auto lo = [](double hi) { return N::of_two ? 0x1p-54 * hi : 0; };
    for (std::size_t i = 0; i < angle.size(); ++i) {
      for (int lane = 0; lane < N::lanes; ++lane)
        N::set(angle[i], lane, x[i * N::lanes + lane], lo(x[i * N::lanes + lane]));
      Numbers<S>::set(added[i], 0, offset[i], lo(offset[i]));
      quarters[i] = static_cast<int>(i) % 4;
    }
    sin_cos(angle, added, quarters, s, c);
    for (std::size_t i = 0; i < angle.size(); ++i)
      for (int lane = 0; lane < N::lanes; ++lane) {
        const Mp sum = N::get(angle[i], lane) + Numbers<S>::get(added[i], 0);
        const Mp turned = sum + Mp(quarters[i]) * acos(Mp(0));
        // A near angle is rounded to the digits of S before anything is done with it.
        const bool near = abs(sum) < 1.7e6 && offset[i] != 0;
        const double u = N::of_two ? 0x1p-104 : in_float ? 0x1p-24 : 0x1p-53;
        const Mp rounding = near ? Mp(abs(sum) * u) : Mp(0);
        for (const auto& [found, truth] : {std::pair{N::get(s[i], lane), Mp(sin(turned))},
                                           std::pair{N::get(c[i], lane), Mp(cos(turned))}}) {
          const Mp allowed = N::of_two ? Mp(0x1p-101) : Mp(2.2 * u * abs(truth) + Mp("1e-690"));
          EXPECT_LE(abs(Mp(found - truth)), Mp(allowed + rounding))
              << x[i * N::lanes + lane] << " + " << offset[i] << ", quarters " << quarters[i];
        }
      }
  }

  static constexpr int count() { return 3 * padding<T> * N::lanes; }

  Random random_{11};
};

using Kinds = testing::Types<float, double, WidePack<float>, WidePack<double>, Pair<double>,
                             Pair<WidePack<double>>, DoubleDouble>;
TYPED_TEST_SUITE(Angles, Kinds);

TYPED_TEST(Angles, OfAnySizeHaveTheirSinesAndCosines) {
  for (int repeat = 0; repeat < 40; ++repeat) {
    std::vector<double> x(this->count()), none(x.size(), 0);
    for (double& angle : x) angle = this->draw();
    this->expect_right(x, none);
  }
}

TYPED_TEST(Angles, WithAnOffsetThatTheirDigitsDoNotReach) {
  for (int repeat = 0; repeat < 40; ++repeat) {
    std::vector<double> x(this->count()), offset(x.size());
    for (double& angle : x) angle = this->draw();
    for (double& angle : offset)
      angle = static_cast<float>(this->random_.uniform(-3, 3) * (repeat % 4 == 0 ? 1e8 : 1));
    this->expect_right(x, offset);
  }
}

// The double that is nearest to a multiple of pi/2, and the float (Muller et al., Handbook of
// Floating-Point Arithmetic).
TYPED_TEST(Angles, NearestToAMultipleOfAQuarterTurn) {
  const double nearest =
      TestFixture::in_float ? std::ldexp(16367173.0, 72) : std::ldexp(6381956970095103.0, 797);
  std::vector<double> x(this->count(), nearest), none(x.size(), 0);
  for (std::size_t i = 0; i < x.size(); i += 2) x[i] = -nearest;
  this->expect_right(x, none);
}

// A far angle changes no bit of its neighbours, in a block or in other lanes.
TYPED_TEST(Angles, FarOnesLeaveTheOthersAlone) {
  using T = TypeParam;
  using N = Numbers<T>;
  std::vector<T> angle(padding<T>, T(typename N::Scalar(0))), s = angle, c = angle, s1 = s, c1 = s;
  std::vector<typename N::Scalar> offset(angle.size(), typename N::Scalar(0.3F));
  std::vector<IntegerOf<typename TestFixture::Given>> quarters(angle.size());
  constexpr int all = padding<T> * N::lanes;
  for (int i = 0; i < all; ++i) N::set(angle[i / N::lanes], i % N::lanes, 0.1F * i, 0);
  sin_cos(angle, offset, quarters, s, c);
  for (int far = 0; far < all; ++far) {
    std::vector<T> changed = angle;
    N::set(changed[far / N::lanes], far % N::lanes, 1e30F, 0);
    sin_cos(changed, offset, quarters, s1, c1);
    for (int i = 0; i < all; ++i) {
      if (i == far) continue;
      EXPECT_EQ(N::get(s1[i / N::lanes], i % N::lanes), N::get(s[i / N::lanes], i % N::lanes));
      EXPECT_EQ(N::get(c1[i / N::lanes], i % N::lanes), N::get(c[i / N::lanes], i % N::lanes));
    }
  }
}

TYPED_TEST(Angles, ThatAreNoNumbersHaveNone) {
  using T = TypeParam;
  using N = Numbers<T>;
  for (const double x :
       {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
        std::numeric_limits<double>::quiet_NaN()}) {
    std::vector<T> angle(padding<T>, T(typename N::Scalar(0))), s = angle, c = angle;
    std::vector<typename N::Scalar> offset(angle.size(), typename N::Scalar(0.3F));
    std::vector<IntegerOf<typename TestFixture::Given>> quarters(angle.size());
    N::set(angle[0], 0, x, 0);
    sin_cos(angle, offset, quarters, s, c);
    EXPECT_TRUE(isnan(N::get(s[0], 0)) && isnan(N::get(c[0], 0))) << x;
    if (padding<T> * N::lanes > 1) {
      const int block = padding<T> > 1, lane = block ? 0 : 1;
      EXPECT_FALSE(isnan(N::get(s[block], lane)) || isnan(N::get(c[block], lane))) << x;
    }
  }
}

// Of one number, with an offset: what the plain recursions and wide precisions take.
TEST(Angles, OfOneNumberKeepTheOffset) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const double x = std::pow(10, random.uniform(-3, 300)), offset = random.uniform(-3, 3);
    double s, c;
    sin_cos(x, offset, s, c);
    const Mp sum = Mp(x) + Mp(offset);
    const Mp allowed = 4 * 0x1p-53 + (x < 1.7e6 ? x * 0x1p-53 : 0);
    EXPECT_LE(abs(Mp(s - sin(sum))), allowed) << x;
    EXPECT_LE(abs(Mp(c - cos(sum))), allowed) << x;
  }
}

}  // namespace
}  // namespace kalmarm::test
