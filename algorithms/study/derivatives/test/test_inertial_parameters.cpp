// Ten inertial parameters of a body and their log-Cholesky coordinates.
#include <Eigen/Cholesky>
#include <cmath>

#include "algorithms/study/derivatives/inertial_rows.hpp"
#include "algorithms/study/derivatives/log_det.hpp"
#include "algorithms/study/derivatives/test/support.hpp"

namespace kalmarm::test {
namespace {

template <class T>
InertialVector<T> random_coordinates(std::uint64_t seed) {
  return InertialVector<double>(Random(seed).vector(body_parameters)).template cast<T>();
}

TEST(LogCholesky, CoordinatesOfABodyGiveItBack) {
  for (int seed = 0; seed < 20; ++seed) {
    Random random(seed);
    const SpatialInertia<double> M(random_body(random));
    const InertialVector<double> theta = inertial_parameters(M),
                                 back = from_log_cholesky(to_log_cholesky(M));
    EXPECT_LE((back - theta).norm(), 1e-13 * theta.norm());
    EXPECT_EQ(spatial_inertia<double>(theta).matrix(), M.matrix());
  }
}

TEST(LogCholesky, EveryPointIsOneBody) {
  for (int seed = 0; seed < 20; ++seed) {
    const InertialVector<double> x = random_coordinates<double>(seed);
    const InertialVector<double> back =
        to_log_cholesky(spatial_inertia<double>(from_log_cholesky(x)));
    EXPECT_LE((back - x).norm(), 1e-10 * x.norm());  // rounding times the condition of S
  }
}

TEST(LogCholesky, EveryPointIsPhysical) {
  for (int seed = 0; seed < 100; ++seed) {
    const InertialVector<Mp> x = random_coordinates<Mp>(seed) * Mp(3);
    const SpatialInertia<Mp> M = spatial_inertia<Mp>(from_log_cholesky(x));
    EXPECT_EQ(pseudo_inertia(M).llt().info(), Eigen::Success);  // positive definite
  }
}

TEST(LogCholesky, JacobianAgreesWithDifferencesAndDualNumbers) {
  for (int seed = 0; seed < 20; ++seed) {
    const InertialVector<double> x = random_coordinates<double>(seed);
    const InertialMatrix<double> J = log_cholesky_jacobian(x);
    for (int i = 0; i < body_parameters; ++i) {
      const Mp step("1e-15");
      const InertialVector<Mp> at = x.cast<Mp>(), to = step * InertialVector<Mp>::Unit(i);
      const InertialVector<double> difference =
          ((from_log_cholesky<Mp>(at + to) - from_log_cholesky<Mp>(at - to)) / (2 * step))
              .eval()
              .cast<double>();
      EXPECT_LE((J.col(i) - difference).norm(), 1e-13 * difference.norm());
      InertialVector<Jet> jets = x.cast<Jet>();
      jets[i].v[0] = 1;
      const InertialVector<Jet> theta = from_log_cholesky(jets);
      for (int j = 0; j < body_parameters; ++j)
        EXPECT_NEAR(J(j, i), theta[j].v[0], 1e-13 * J.col(i).norm());
    }
  }
}

// Of a solid ball's pseudo-inertia, in closed form: Sigma = m R^2 / 5.
TEST(LogCholesky, OfABallIsTheLogarithmOfItsRadius) {
  const double m = 3, R = 0.2;
  const RigidBody<double> ball{
      m, {0.1, -0.4, 0.7}, {1, 0, 0, 0}, Vector3<double>::Constant(0.4 * m * R * R)};
  InertialVector<double> expected;
  const double d = std::log(R / std::sqrt(5));
  expected << std::log(m) / 2, d, d, d, 0, 0, 0, 0.1, -0.4, 0.7;
  EXPECT_LE((to_log_cholesky(SpatialInertia<double>(ball)) - expected).norm(), 1e-13);
}

TEST(LogCholesky, ABodyThatCannotBeIsNotANumber) {
  Random random(1);
  RigidBody<double> body = random_body(random);
  const auto is_nan = [](const RigidBody<double>& body) {
    return to_log_cholesky(SpatialInertia<double>(body)).hasNaN();
  };
  EXPECT_FALSE(is_nan(body));
  RigidBody<double> negative = body;
  negative.mass = -1;
  EXPECT_TRUE(is_nan(negative));
  RigidBody<double> sharp = body;  // Ixx > Iyy + Izz
  sharp.moments = {1, 0.4, 0.4};
  EXPECT_TRUE(is_nan(sharp));
}

// tr(M S) is what inertial_gradient weighs theta with, y' M x what bilinear does.
TEST(InertialRows, AreGradientsOfLinearForms) {
  for (int seed = 0; seed < 10; ++seed) {
    Random random(seed);
    const InertialVector<double> theta = random.vector(body_parameters);
    const Matrix6<double> M = spatial_inertia<double>(theta).matrix();
    const Vector6<double> y = random.vector(6), x = random.vector(6), v = random.vector(6);
    EXPECT_NEAR(bilinear(y, x).dot(theta), y.dot(M * x), 1e-13);
    const Matrix6<double> S = y * x.transpose() + x * y.transpose();
    EXPECT_NEAR(inertial_gradient(S).dot(theta), (M * S).trace(), 1e-13);
    const Vector6<double> force = M * x + cross_force(v, Vector6<double>(M * v));
    EXPECT_NEAR(InertialForce<double>(x, v).row(y).dot(theta), y.dot(force), 1e-12);
  }
}

}  // namespace
}  // namespace kalmarm::test
