// The filter that makes accelerations: exact where it must be, no delay, noise as the formula says.
#include <gtest/gtest.h>

#include <cmath>

#include "accuracy/fits/differentiate.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

// One DoF with qd = f(t) at the given times.
template <class F>
Samples sampled(const VectorX<double>& time, F&& f) {
  Samples samples;
  samples.time = time;
  samples.qd = time.unaryExpr(f).transpose();
  return samples;
}

VectorX<double> even_times(int count, double dt) {
  return VectorX<double>::LinSpaced(count, 0, (count - 1) * dt);
}

// Savitzky and Golay's weight of neighbour j, step 1, for degrees 3 and 4.
double weight(int j, int h) {
  const double m = h, m2 = m * m;
  return 5 *
         (5 * (3 * m2 * m2 + 6 * m2 * m - 3 * m + 1) * j - 7 * (3 * m2 + 3 * m - 1) * j * j * j) /
         ((2 * m + 3) * (2 * m + 1) * (2 * m - 1) * (m + 2) * (m + 1) * m * (m - 1));
}

TEST(Differentiate, IsExactForPolynomialsUpToTheDegreeWithUnevenStepsAndAtTheEnds) {
  VectorX<double> time = even_times(60, 0.01);
  for (int i = 0; i < 60; ++i) time[i] += 0.003 * std::sin(7.0 * i);
  for (const int degree : {1, 2, 3, 4, 5}) {
    Samples samples = sampled(time, [&](double t) { return std::pow(t + 0.5, degree); });
    differentiate(samples, {.degree = degree, .half_width = 7});
    for (int i = 0; i < samples.count(); ++i)
      EXPECT_NEAR(samples.qdd(0, i), degree * std::pow(time[i] + 0.5, degree - 1), 1e-10)
          << degree << ' ' << i;
  }
}

TEST(Differentiate, OneDegreeHigherIsNotExact) {
  Samples samples = sampled(even_times(60, 0.01), [](double t) { return std::pow(t, 5); });
  differentiate(samples, {.degree = 3, .half_width = 7});
  EXPECT_GT(std::abs(samples.qdd(0, 30) - 5 * std::pow(0.3, 4)), 1e-6);
}

TEST(Differentiate, DelaysNoSineAndHasTheGainOfItsWeights) {
  constexpr int h = 10;
  constexpr double dt = 0.01;
  for (const double fraction : {0.01, 0.05, 0.1, 0.2}) {  // of the sampling frequency
    const double omega = 2 * M_PI * fraction / dt;
    Samples samples =
        sampled(even_times(200, dt), [&](double t) { return std::sin(omega * t + 0.4); });
    differentiate(samples, {.degree = 4, .half_width = h});
    double gain = 0;
    for (int j = 1; j <= h; ++j) gain += 2 * weight(j, h) / dt * std::sin(j * omega * dt);
    for (int i = h; i < 200 - h; ++i)
      EXPECT_NEAR(samples.qdd(0, i), gain * std::cos(omega * samples.time[i] + 0.4), 1e-10 / dt);
  }
}

TEST(Differentiate, TheDefaultPassesWhatItsHeaderSays) {
  const LocalPolynomial filter;
  ASSERT_EQ(filter.degree, 4);
  const auto gain = [&](double fraction) {
    double sum = 0;
    for (int j = 1; j <= filter.half_width; ++j)
      sum += 2 * weight(j, filter.half_width) * std::sin(2 * M_PI * fraction * j);
    return sum / (2 * M_PI * fraction);
  };
  EXPECT_NEAR(gain(0.023), 0.99, 1e-3);
  EXPECT_NEAR(gain(0.0599), std::sqrt(0.5), 2e-3);
  EXPECT_NEAR(gain(0.1026), 0, 1e-3);
  for (double fraction = 0.1026; fraction < 0.5; fraction += 1e-3)
    EXPECT_LT(std::abs(gain(fraction)), 0.13);
}

// White noise of variance 1 in: an impulse at every place in turn gives each weight.
TEST(Differentiate, GainOfNoiseIsTheRootOfTheSumOfSquares) {
  constexpr int h = 10, count = 4 * h;
  constexpr double dt = 0.01;
  double variance = 0;
  for (int place = 0; place < count; ++place) {
    Samples samples = sampled(even_times(count, dt), [](double) { return 0.0; });
    samples.qd(0, place) = 1;
    differentiate(samples);
    variance += samples.qdd(0, 2 * h) * samples.qdd(0, 2 * h);
  }
  const double m = h, closed_form = 25 * (3 * m * m * m * m + 6 * m * m * m - 3 * m + 1) /
                                    ((2 * m + 3) * (2 * m + 1) * (2 * m - 1) * (m + 2) * (m + 1) *
                                     m * (m - 1));
  EXPECT_NEAR(std::sqrt(variance) * dt, std::sqrt(closed_form), 1e-10);
  EXPECT_NEAR(std::sqrt(variance) * dt, 0.091, 5e-4);
}

TEST(Differentiate, FewSamplesNarrowTheWindowAndTooFewAreRefused) {
  Samples three = sampled(even_times(3, 0.1), [](double t) { return t * t; });
  differentiate(three, {.degree = 2, .half_width = 10});
  EXPECT_NEAR(three.qdd(0, 2), 0.4, 1e-12);
  EXPECT_THROW(differentiate(three, {.degree = 3, .half_width = 10}), InputError);
  EXPECT_THROW(differentiate(three, {.degree = 0, .half_width = 1}), InputError);
}

}  // namespace
}  // namespace kalmarm
