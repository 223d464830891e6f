// Velocities and accelerations from positions alone: exact where they must be, on all kinds of
// joints, and good enough for a fit by a bound that follows from the noise.
#include <gtest/gtest.h>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <cmath>
#include <numbers>

#include "accuracy/fits/differentiate.hpp"
#include "accuracy/fits/excitation.hpp"
#include "accuracy/fits/fit.hpp"
#include "accuracy/fits/prediction.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

// two_link with both positions f(t), without velocities.
template <class F>
Samples positions(const VectorX<double>& time, F&& f) {
  Samples samples;
  samples.time = time;
  samples.q = VectorX<double>::Ones(2) * time.unaryExpr(f).transpose();
  samples.tau = MatrixX<double>::Zero(2, time.size());
  return samples;
}

VectorX<double> even_times(int count, double dt) {
  return VectorX<double>::LinSpaced(count, 0, (count - 1) * dt);
}

const Model<double>& two_link() {
  static const Scene scene = load_scene("two_link");
  return scene.model;
}

TEST(DifferentiatePositions, IsExactForPolynomialsUpToTheDegreeWithUnevenSteps) {
  VectorX<double> time = even_times(60, 0.01);
  for (int i = 0; i < 60; ++i) time[i] += 0.003 * std::sin(7.0 * i);
  for (const int degree : {2, 3, 4, 5}) {
    Samples samples = positions(time, [&](double t) { return std::pow(t + 0.5, degree); });
    differentiate_positions(samples, two_link(), {.degree = degree, .half_width = 7});
    ASSERT_EQ(samples.count(), 60 - 14);
    for (int i = 0; i < samples.count(); ++i) {
      const double t = samples.time[i] + 0.5;
      EXPECT_EQ(samples.time[i], time[i + 7]);
      EXPECT_NEAR(samples.qd(1, i), degree * std::pow(t, degree - 1), 1e-10);
      EXPECT_NEAR(samples.qdd(1, i), degree * (degree - 1) * std::pow(t, degree - 2), 1e-8);
    }
  }
}

// A sine comes out as a sine of the same phase, with the gain that the header states.
TEST(DifferentiatePositions, DelaysNoSine) {
  constexpr double dt = 0.01;
  const auto acceleration_gain = [&](double fraction) {
    const double omega = 2 * M_PI * fraction / dt;
    Samples samples =
        positions(even_times(200, dt), [&](double t) { return std::sin(omega * t + 0.4); });
    differentiate_positions(samples, two_link());
    const auto phase = omega * samples.time.array() + 0.4;
    const Eigen::RowVectorXd right = -omega * omega * phase.sin().transpose();
    const double gain = samples.qdd.row(0).dot(right) / right.squaredNorm();
    EXPECT_LE((samples.qdd.row(0) - gain * right).norm(), 1e-10 * right.norm());
    return gain;
  };
  EXPECT_NEAR(acceleration_gain(0.0262), 0.99, 1e-3);
  EXPECT_NEAR(acceleration_gain(0.0679), std::sqrt(0.5), 1e-3);
  EXPECT_NEAR(acceleration_gain(0.1218), 0, 1e-3);
}

// White noise of variance 1 in: an impulse at every place in turn gives each weight.
TEST(DifferentiatePositions, PassesTheNoiseThatItsHeaderSays) {
  constexpr int h = 10;
  constexpr double dt = 0.01;
  double of_velocity = 0, of_acceleration = 0;
  for (int place = 0; place < 4 * h; ++place) {
    Samples samples = positions(even_times(4 * h, dt), [](double) { return 0.0; });
    samples.q(0, place) = 1;
    differentiate_positions(samples, two_link());
    of_velocity += std::pow(samples.qd(0, h), 2);
    of_acceleration += std::pow(samples.qdd(0, h), 2);
  }
  EXPECT_NEAR(std::sqrt(of_velocity) * dt, 0.091, 5e-4);
  EXPECT_NEAR(std::sqrt(of_acceleration) * dt * dt, 0.048, 5e-4);
}

// Of a free body, slides and hinges, against the series' own derivatives. Its fastest harmonic turns
// by 2 pi 5 / 1000 a step, so that the gains miss 1 by at most 23.3 and 14.6 of the fourth power of
// that, 2.3e-5 and 1.4e-5; products of harmonics in a quaternion go a little beyond.
TEST(DifferentiatePositions, KnowsAllKindsOfJoints) {
  for (const char* robot : {"go2", "tree:7"}) {
    const Scene scene = load_scene(robot);
    const Samples right =
        excite(scene, {.count = 1000, .period = 10, .speed = 2, .candidates = 1}).samples;
    Samples samples = right;
    samples.qd.resize(0, 0);
    samples.qdd.resize(0, 0);
    differentiate_positions(samples, scene.model);
    const auto middle = Eigen::seqN(10, samples.count());
    EXPECT_EQ(samples.q, right.q(Eigen::all, middle)) << robot;
    EXPECT_LE((samples.qd - right.qd(Eigen::all, middle)).norm(), 1e-4 * right.qd.norm()) << robot;
    EXPECT_LE((samples.qdd - right.qdd(Eigen::all, middle)).norm(), 1e-4 * right.qdd.norm())
        << robot;
  }
}

TEST(DifferentiatePositions, WholeTurnsAndSignsOfQuaternionsDoNotMatter) {
  const Scene scene = load_scene("go2");
  Samples samples = excite(scene, {.count = 100, .period = 1, .candidates = 1}).samples;
  Samples turned = samples;
  for (int i = 0; i < turned.count(); ++i) {
    if (i % 3 == 1) turned.q.col(i).segment<4>(3) *= -1;
    turned.q(8, i) += 2 * std::numbers::pi * (i % 5 - 2);
  }
  differentiate_positions(samples, scene.model);
  differentiate_positions(turned, scene.model);
  EXPECT_LE((turned.qd - samples.qd).norm(), 1e-11 * samples.qd.norm());
  EXPECT_LE((turned.qdd - samples.qdd).norm(), 1e-9 * samples.qdd.norm());
}

// Root mean squares of M e over the samples, for e of independent N(0, deviation^2).
VectorX<double> torque_noise(const Model<double>& model, const Samples& samples, double deviation) {
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(model.nv(), model.nv());
  VectorX<double> squares = VectorX<double>::Zero(model.nv());
  for (int i = 0; i < samples.count(); ++i) {
    set_position(model, samples.q.col(i), kin);
    mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
    squares += M.rowwise().squaredNorm();
  }
  return deviation * (squares / samples.count()).cwiseSqrt();
}

// Noise sigma of the positions is 0.048 sigma / dt^2 in the accelerations, and M times that in the
// torques; what it does there by q and q' is less than a hundredth. A fit by least squares misses
// the torques by a projection of that error, so by no more than it, whether they are compared with
// the truth or with a fit of exact velocities and accelerations, which finds the truth.
TEST(FitOfPositions, AgreesWithAFitOfVelocitiesWithinTheNoise) {
  const Scene scene = load_scene("iiwa14");
  constexpr double sigma = 2e-5, dt = 10.0 / 4000;  // a fifth of a step of a 16-bit encoder
  const Mechanics<double> truth = mechanics_of(scene);
  Samples exact = excite(scene, {.count = 4000, .period = 10, .candidates = 5}).samples;
  exact.tau = torques(truth, exact);
  Samples noisy = exact;
  boost::random::mt19937 random(7);
  boost::random::normal_distribution<double> normal(0, sigma);
  for (double& x : noisy.q.reshaped()) x += normal(random);
  noisy.qd.resize(0, 0);
  noisy.qdd.resize(0, 0);
  differentiate_positions(noisy, scene.model);

  const VectorX<double> bound = torque_noise(scene.model, exact, 0.0476 * sigma / (dt * dt));
  const auto deviation = [](const MatrixX<double>& error) {
    return VectorX<double>(error.rowwise().norm() / std::sqrt(error.cols()));
  };
  const VectorX<double> measured = deviation(torques(truth, noisy) - noisy.tau);
  for (int k = 0; k < scene.model.nv(); ++k)  // 400 independent windows: 4 % twice over
    EXPECT_NEAR(measured[k] / bound[k], 1, 0.15) << k;

  FreeParameters free;
  for (int k = 0; k < scene.model.nv(); ++k) free.bodies.push_back(k);
  const Fit by_positions = fit(truth, free, noisy, {}), by_all = fit(truth, free, exact, {});
  ASSERT_TRUE(by_positions.usable && by_all.usable);
  const VectorX<double> scale = row_sizes(exact.tau);
  const MatrixX<double> difference =
      torques(by_positions.robot, exact) - torques(by_all.robot, exact);
  EXPECT_LE((deviation(difference).array() / scale.array()).matrix().norm(),
            1.15 * (bound.array() / scale.array()).matrix().norm());
  EXPECT_GT(difference.norm(), 0);
}

std::string complaint(Samples samples, const LocalPolynomial& filter = {}) {
  try {
    differentiate_positions(samples, two_link(), filter);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(DifferentiatePositions, TooFewSamplesAndGapsAreRefused) {
  const auto still = [](double) { return 1.0; };
  EXPECT_EQ(complaint(positions(even_times(21, 0.01), still)),
            "21 samples of positions without velocities, at least 22 are needed");
  EXPECT_EQ(complaint(positions(even_times(22, 0.01), still)), "");
  VectorX<double> time = even_times(40, 0.125);
  time.tail(10).array() += 0.375;  // four steps
  EXPECT_EQ(complaint(positions(time, still)), "");
  time.tail(10).array() += 0.125;
  EXPECT_EQ(complaint(positions(time, still)),
            "after time 3.625 comes a step of 0.625, the median is 0.125: positions are not "
            "differentiated across a gap");
  EXPECT_NE(complaint(positions(even_times(40, 0.1), still), {.degree = 1}), "");
  EXPECT_NE(complaint(positions(even_times(40, 0.1), still), {.degree = 4, .half_width = 1}), "");
}

}  // namespace
}  // namespace kalmarm
