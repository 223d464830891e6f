// What is exact of the simulated random model: its sigma points, the recursions, one sample.
#include <cmath>
#include <limits>

#include "accuracy/simulation/test/robot.hpp"
#include "algorithms/study/estimation/covariance_analysis.hpp"

namespace kalmarm::test {
namespace {

class EveryFamily : public testing::TestWithParam<Family> {
 protected:
  Digits precision_{digits};
  Model<double> model_ = GetParam().make(seed);

  static void expect_near(const MatrixX<Real>& C, const MatrixX<Real>& exact, double tolerance) {
    ASSERT_EQ(C.rows(), exact.rows());
    EXPECT_LE((C - exact).norm(), tolerance * exact.norm());
  }
};

TEST_P(EveryFamily, SigmaPointsAndRecursionsGiveTheCovariances) {
  const Reference exact = reference_of(model_);
  const Robot<Real> robot(model_);
  for (const Quantity quantity : quantities)
    expect_near(sigma_point_covariance(robot.simulation, quantity), exact[quantity], 1e-45);
  MatrixX<Real> C;
  state_error_covariance(robot.process, robot.cov, C);
  expect_near(C, exact.P, 1e-45);
  co_state_covariance(robot.process, robot.cov, C);
  expect_near(C, exact.Lambda, 1e-45);

  const Robot<double> rounded(model_);
  for (const Quantity quantity : quantities)
    EXPECT_LE(relative_error(sigma_point_covariance(rounded.simulation, quantity),
                             Exact(exact[quantity])),
              1e-13);
}

TEST_P(EveryFamily, InnovationsAreUncorrelated) {
  const MatrixX<double> D = sigma_point_covariance(Robot<double>(model_).simulation, Quantity::D);
  for (int i = 0; i < D.rows(); ++i)
    for (int j = 0; j < i; ++j) EXPECT_LE(std::abs(D(i, j)), 1e-11 * std::sqrt(D(i, i) * D(j, j)));
}

INSTANTIATE_TEST_SUITE_P(Models, EveryFamily, testing::ValuesIn(families()),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(ReferenceCovariances, OfOneBodyAreKnownByHand) {
  const Digits precision(digits);
  const Model<double> model = one_slide(seed);
  const Reference exact = reference_of(model);
  const Real mass = model.joint(0).body.mass;
  EXPECT_EQ(exact.M(0, 0), mass);
  EXPECT_EQ(exact.D(0, 0), mass);
  EXPECT_LE((exact.P - model.cast<Real>().M(0).matrix()).norm(), 1e-55);
  EXPECT_EQ(exact.Lambda, (MatrixX<Real>::Zero(6, 6)));
}

TEST(RelativeError, IsSeenFarBelowTheRoundingOfAResult) {
  const Digits precision(digits);
  const MatrixX<Real> A = MatrixX<Real>::Constant(1, 1, 1 + Real("1e-20"));
  EXPECT_DOUBLE_EQ(relative_error(MatrixX<double>::Ones(1, 1), Exact(A)), 1e-20);
  const Exact zero(MatrixX<Real>::Zero(2, 2));
  EXPECT_EQ(relative_error(MatrixX<double>::Zero(2, 2), zero), 0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(relative_error(MatrixX<double>::Constant(1, 1, nan), Exact(A))));
}

TEST(OneSample, WritesEveryEntryAndReadsNoOldOne) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Robot<double> robot(floating_base(seed));
  const VectorX<double> normals = Random(seed).vector(robot.simulation.dimension);
  for (const Quantity quantity : quantities) {
    Sample<double> sample(robot.simulation);
    for (Vector6<double>& x : sample.x) x.setConstant(nan);
    for (auto* of_links : {&sample.estimate.z_minus, &sample.estimate.z_plus,
                           &sample.estimate.l_minus, &sample.estimate.l_plus})
      for (Vector6<double>& x : *of_links) x.setConstant(nan);
    for (auto* of_joints :
         {&sample.tau, &sample.estimate.e_minus, &sample.estimate.e_plus, &sample.estimate.a})
      of_joints->setConstant(nan);
    VectorX<double> once = VectorX<double>::Constant(robot.simulation.size(quantity), nan);
    VectorX<double> twice = once;
    observe(robot.simulation, quantity, normals, sample, Eigen::Ref<VectorX<double>>(once));
    observe(robot.simulation, quantity, normals, sample, Eigen::Ref<VectorX<double>>(twice));
    EXPECT_TRUE(once.allFinite());
    EXPECT_EQ(once, twice);
  }
}

TEST(OneSample, IsTheSameInMotionAndAtRest) {
  const Model<double> model = floating_base(seed);
  const Robot<double> moving(model, 1), resting(model, 0);
  const VectorX<double> normals = Random(seed).vector(moving.simulation.dimension);
  ASSERT_GT((moving.process.b[9] - resting.process.b[9]).norm(), 0.1);
  for (const Quantity quantity : quantities) {
    VectorX<double> y[2];
    int i = 0;
    for (const Robot<double>* robot : {&moving, &resting}) {
      Sample<double> sample(robot->simulation);
      y[i].resize(robot->simulation.size(quantity));
      observe(robot->simulation, quantity, normals, sample, Eigen::Ref<VectorX<double>>(y[i++]));
    }
    EXPECT_EQ(y[0], y[1]);
  }
}

}  // namespace
}  // namespace kalmarm::test
