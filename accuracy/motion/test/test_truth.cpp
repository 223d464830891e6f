// The proven end of a motion against closed forms, and what has none.
#include <gtest/gtest.h>

#include "accuracy/motion/test/oscillator.hpp"
#include "accuracy/motion/truth.hpp"

namespace kalmarm::motion {
namespace {

TEST(TrueEnd, OfAnOscillatorIsItsClosedForm) {
  for (const double k : {0.5, 800.0, 1e6})
    for (const double swept : {0.0, 200.0}) {
      const Oscillator oscillator{.k = k, .swept = swept};
      const Truth truth = true_end(oscillator.motion());
      const auto [q, v] = oscillator.end();
      const long double w = std::sqrt(static_cast<long double>(k) / oscillator.m);
      const long double size = std::abs(q) + std::abs(v) / w + 1;
      EXPECT_LE(std::abs(truth.q[0] - q), 1e-14L * size) << k << ' ' << swept;
      EXPECT_LE(std::abs(truth.v[0] - v), 1e-14L * size * w) << k << ' ' << swept;
      EXPECT_LE(truth.difference.q, 1e-12);
      EXPECT_GT(truth.calls, 0);
    }
}

// Critically damped: x = (x0 + (v0 + w x0) t) exp(-w t).
TEST(TrueEnd, OfADampedOscillatorIsItsClosedForm) {
  Oscillator oscillator{.m = 2, .k = 800, .b = 80};
  const long double w = 20, rest = 0.25L + 3.0L / 800, t = oscillator.duration;
  const long double x0 = oscillator.q - rest, slope = oscillator.v + w * x0;
  const Truth truth = true_end(oscillator.motion());
  EXPECT_LE(std::abs(truth.q[0] - (rest + (x0 + slope * t) * std::exp(-w * t))), 1e-15L);
  EXPECT_LE(std::abs(truth.v[0] - (slope - w * (x0 + slope * t)) * std::exp(-w * t)), 1e-14L);
}

// Without forces a body keeps its energy, its angular momentum in the world, and how fast its com is.
TEST(TrueEnd, OfATumblingBodyKeepsItsMomentum) {
  const Motion motion = tumbling(3);
  const Truth truth = true_end(motion);
  const Eigen::Matrix<long double, 3, 1> com(0.1, -0.2, 0.05);
  const auto of = [&](const VectorX<long double>& q, const VectorX<long double>& v) {
    const Eigen::Quaternion<long double> Q(q[3], q[4], q[5], q[6]);
    const Eigen::Matrix<long double, 3, 1> w = v.tail<3>(), L(0.3 * w[0], 0.5 * w[1], 0.7 * w[2]);
    Eigen::Matrix<long double, 6, 1> out;
    out << Q.normalized() * L, v.head<3>() + Q.normalized() * w.cross(com);
    return out;
  };
  const auto before = of(motion.q.cast<long double>(), motion.v.cast<long double>());
  EXPECT_LE((of(truth.q, truth.v) - before).norm(), 1e-13L * before.norm());
  EXPECT_GT((truth.q.head<3>()).norm(), 0.5L);
}

TEST(TrueEnd, ThatNeedsTooManyCallsIsRefused) {
  EXPECT_THROW((void)true_end(Oscillator{.k = 1e6}.motion(), {.cap = 1000}), NoTruth);
}

TEST(TrueEnd, ThatIsNotProvenIsRefused) {
  EXPECT_THROW((void)true_end(Oscillator{}.motion(), {.tolerance = 1e-6, .agreement = 1e-12}),
               NoTruth);
}

}  // namespace
}  // namespace kalmarm::motion
