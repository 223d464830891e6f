// Derivatives of forward dynamics against differences of truth in 50 digits and against physics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "algorithms/fast/test/derivatives_support.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

// A bound by the condition of M is one of the size of errors: their geometric mean keeps to it. One
// error in twenty is up to 2.4 times as large, and the largest of all families, on a gimbal near its
// lock (massless_links), 3.1 times: compilers contract differently.
TEST(AccelerationDerivatives, AgreeWithDifferencesOfTruth) {
  constexpr int seeds = 3;
  std::vector<Family> all = all_families();
  all.push_back({"long_chain", [](std::uint64_t seed) { return long_chain(seed, 19); }});
  for (const Family& family : all) {
    double log_float64 = 0, log_float32 = 0;
    for (int seed = 3; seed < 3 + seeds; ++seed) {
      const Model<double> model = family.make(seed);
      const State<double> state = random_state(model, seed + 1);
      const TrueDerivatives truth(model, state);
      const double bound = 40 + 2 * std::sqrt(truth.condition());
      const double float64 = truth.error(derivatives(model, state)) / unit_roundoff<double>();
      const double float32 = truth.error(derivatives(model, state.cast<float>()).cast<double>()) /
                             static_cast<double>(unit_roundoff<float>());
      EXPECT_LE(float64, 4 * bound) << family.name;
      EXPECT_LE(float32, 4 * bound) << family.name;
      log_float64 += std::log((float64 + 0.1) / bound) / seeds;
      log_float32 += std::log((float32 + 0.1) / bound) / seeds;
    }
    EXPECT_LE(log_float64, 0) << family.name;
    EXPECT_LE(log_float32, 0) << family.name;
    RecordProperty(std::string(family.name) + "_float64", std::to_string(std::exp(log_float64)));
    RecordProperty(std::string(family.name) + "_float32", std::to_string(std::exp(log_float32)));
  }
}

template <class T>
class DerivativesOf : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(DerivativesOf, Precisions, PrecisionName);

TYPED_TEST(DerivativesOf, NothingIsWrittenOutside) {
  using T = TypeParam;
  constexpr int guard = 32;
  for (int n : {1, 5, 8, 13, 16, 23, 37}) {
    const State<T> state = random_state(chain(7, n), 8).template cast<T>();
    Dynamics<T> robot = dynamics_of<T>(chain(7, n), spatial({Want::derivatives}));
    std::vector<T> out[3];
    for (auto& matrix : out) matrix.assign(n * n + 2 * guard, T(-77));
    const auto inside = [&](int i) { return MatrixView<T>(&out[i][guard], n, n); };
    VectorX<T> a(n);
    EXPECT_TRUE(robot.derivatives(state.q, state.qd, state.tau,
                                  {.dq = inside(0), .dqd = inside(1), .dtau = inside(2)}, a));
    for (const auto& matrix : out)
      for (int i = 0; i < guard; ++i) {
        EXPECT_EQ(matrix[i], T(-77)) << n;
        EXPECT_EQ(matrix[guard + n * n + i], T(-77)) << n;
      }
  }
}

TYPED_TEST(DerivativesOf, TorqueGivesASymmetricMatrixToTheBit) {
  using T = TypeParam;
  std::vector<Family> all = all_families();
  all.push_back({"long_chain", [](std::uint64_t seed) { return long_chain(seed, 45); }});
  for (const Family& family : all) {
    const Model<double> model = family.make(5);
    const AccelerationDerivatives<T> out =
        derivatives(model, random_state(model, 6).template cast<T>());
    EXPECT_TRUE((out.dtau.array() == out.dtau.transpose().array()).all()) << family.name;
  }
}

// Galileo: neither where a free robot is nor how fast it travels matters, to the bit.
TYPED_TEST(DerivativesOf, TravellingChangesNothing) {
  using T = TypeParam;
  const Model<double> model = floating_base(11);
  const State<double> state = random_state(model, 12);
  State<double> far = state;
  far.q.head<3>() += Vector3<double>(1e6, -3e5, 7e7);
  far.qd.head<3>() += Vector3<double>(1e4, 2e3, -5e3);
  const AccelerationDerivatives<T> here = derivatives(model, state.cast<T>());
  const AccelerationDerivatives<T> there = derivatives(model, far.cast<T>());
  EXPECT_TRUE((here.dq.array() == there.dq.array()).all());
  EXPECT_TRUE((here.dqd.array() == there.dqd.array()).all());
  EXPECT_TRUE((here.dtau.array() == there.dtau.array()).all());
  EXPECT_TRUE(here.dq.leftCols(3).isZero(0));
  EXPECT_TRUE(here.dqd.leftCols(3).isZero(0));
}

// In a uniform field, a robot that nothing holds moves its joints alike in every attitude.
TYPED_TEST(DerivativesOf, TurningAFreeRobotDoesNotMoveItsJoints) {
  using T = TypeParam;
  const Model<double> model = floating_base(13);
  State<double> state = random_state(model, 14);
  state.tau.head<6>().setZero();
  const AccelerationDerivatives<T> out = derivatives(model, state.cast<T>());
  const auto turned = out.dq.template middleCols<3>(3);
  EXPECT_LE(turned.bottomRows(model.nv() - 3).norm(), 500 * unit_roundoff<T>() * out.dq.norm());
  // The base itself falls in another direction of its own axes, which are the world's: not at all.
  EXPECT_GE(out.dq.norm(), 1);
}

TYPED_TEST(DerivativesOf, TreesOfAForestDoNotTouch) {
  using T = TypeParam;
  const Model<double> model = forest(3);
  const AccelerationDerivatives<T> out =
      derivatives(model, random_state(model, 4).template cast<T>());
  for (int i = 0; i < model.nv(); ++i)
    for (int j = 0; j < model.nv(); ++j) {
      if (i % 3 == j % 3) continue;
      EXPECT_EQ(out.dq(i, j), T(0));
      EXPECT_EQ(out.dqd(i, j), T(0));
      EXPECT_EQ(out.dtau(i, j), T(0));
    }
}

TYPED_TEST(DerivativesOf, SingularMechanismIsRefusedAndItsNeighbourIsNot) {
  using T = TypeParam;
  const auto outcome = [](const Mechanism& mechanism) {
    const VectorX<T> ones = VectorX<T>::Ones(mechanism.model.nv());
    AccelerationDerivatives<T> out(mechanism.model.nv());
    return derivatives(mechanism.model, State<T>{mechanism.q.template cast<T>(), ones, ones}, out);
  };
  for (int seed = 0; seed < 10; ++seed) {
    for (const Mechanism& mechanism : singular_mechanisms(seed)) {
      const Outcome refused = outcome(mechanism);
      EXPECT_EQ(refused.status, Outcome::Status::singular) << mechanism.name << " seed " << seed;
      EXPECT_TRUE(std::ranges::count(mechanism.joints, refused.joint)) << mechanism.name;
    }
    for (const Mechanism& mechanism : regular_mechanisms(seed))
      EXPECT_TRUE(outcome(mechanism)) << mechanism.name << " seed " << seed;
  }
}

// The error of an a, or of a solve that judged the state, is not theirs.
TYPED_TEST(DerivativesOf, ClaimNoErrorAndWarnWhereAnInnovationCovarianceIsLost) {
  using T = TypeParam;
  for (const Tolerance tolerance : tolerances)
    for (const double ratio : {1.0, 1e20}) {
      SCOPED_TRACE(testing::Message() << name_of(tolerance) << " ratio " << ratio);
      const Model<double> even = chain(3, 12);
      std::vector<Joint<double>> joints;
      for (int k = 0; k < even.nv(); ++k) joints.push_back(even.joint(k));
      joints.back().body.mass *= ratio;
      const Model<double> model(std::move(joints), even.names(), even.nq(), even.gravity());
      const State<T> state = random_state(model, 4).template cast<T>();
      AccelerationDerivatives<T> out(model.nv());
      const Outcome outcome =
          dynamics_of<T>(model, spatial({Want::derivatives}, tolerance))
              .derivatives(state.q, state.qd, state.tau,
                           {.dq = out.dq, .dqd = out.dqd, .dtau = out.dtau}, out.a);
      ASSERT_TRUE(outcome);
      EXPECT_TRUE(std::isnan(outcome.error));
      EXPECT_EQ(outcome.warns(), ratio > 1);
      EXPECT_EQ(outcome.joint >= 0, ratio > 1);
    }
}

TYPED_TEST(DerivativesOf, StateThatIsNotANumberIsRefused) {
  using T = TypeParam;
  const Model<double> model = chain(3);
  const State<T> state = random_state(chain(3), 4).template cast<T>();
  for (int part = 0; part < 3; ++part) {
    State<T> bad = state;
    (part == 0 ? bad.q : part == 1 ? bad.qd : bad.tau)[4] = std::numeric_limits<T>::quiet_NaN();
    AccelerationDerivatives<T> out(model.nv());
    EXPECT_FALSE(derivatives(model, bad, out));
  }
}

}  // namespace
}  // namespace kalmarm::test
