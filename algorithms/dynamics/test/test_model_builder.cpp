// Robots built by hand against mechanics: energies of bodies that are followed from their joints; the
// same robot lowered by hand; the double pendulum of the textbooks.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/dynamics/test/bodies.hpp"
#include "algorithms/fast/lowering/zero_terms.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

// By polarisation that is all of M: M(i,j) = T(e_i + e_j) - T(e_i) - T(e_j).
TEST(ModelBuilder, MassIsThatOfTheBodiesKineticEnergy) {
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Robot given = everything_by_hand(seed);
    Asked asked(given);
    const MatrixX<double> M = asked.mass();
    const int nv = asked.robot.nv();
    const auto energy = [&](const VectorX<double>& qd) {
      return kinetic_energy(given, asked.state.q, qd);
    };
    const VectorX<double>& qd = asked.state.qd;
    EXPECT_NEAR(qd.dot(M * qd) / 2 / energy(qd), 1, 1e-13);
    const auto e = [nv](int i) { return VectorX<double>(VectorX<double>::Unit(nv, i)); };
    for (int j = 0; j < nv; ++j)
      for (int i = 0; i <= j; ++i) {
        const double entry =
            i == j ? 2 * energy(e(i)) : energy(e(i) + e(j)) - energy(e(i)) - energy(e(j));
        EXPECT_NEAR(M(i, j), entry, 1e-12 * std::sqrt(M(i, i) * M(j, j))) << i << ' ' << j;
      }
  }
}

TEST(ModelBuilder, GravityIsTheSlopeOfThePotentialEnergy) {
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Robot given = everything_by_hand(seed);
    const ModelBuilder builder = given.builder();
    Asked asked(given);
    VectorX<double> gravity = poisoned<double>(asked.robot.nv());
    asked.robot.gravity(asked.state.q, gravity);
    const double h = 1e-5;
    for (std::size_t b = 0; b < given.bodies.size(); ++b)
      for (int i = 0; i < dof_of(given.bodies[b].joint); ++i) {
        const bool free = given.bodies[b].joint == JointType::free;
        const bool turns = given.bodies[b].joint == JointType::ball || (free && i > 2);
        const int first = builder.first_q(b), k = builder.first_dof(b) + i;
        const auto at = [&](double step) {
          VectorX<double> q = asked.state.q;
          if (turns) {  // about an axis of the body
            const int start = first + (free ? 3 : 0), axis = free ? i - 3 : i;
            Eigen::Quaterniond turn(std::cos(step / 2), 0, 0, 0);
            turn.vec()[axis] = std::sin(step / 2);
            const Eigen::Quaterniond now(q[start], q[start + 1], q[start + 2], q[start + 3]);
            const Eigen::Quaterniond then = now * turn;
            q.segment<4>(start) << then.w(), then.x(), then.y(), then.z();
          } else {
            q[first + i] += step;
          }
          return potential_energy(given, q);
        };
        EXPECT_NEAR(gravity[k], (at(h) - at(-h)) / (2 * h), 1e-7 * (1 + gravity.norm())) << k;
      }
  }
}

TEST(ModelBuilder, IsTheRobotThatIsLoweredByHand) {
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Robot given = everything_by_hand(seed);
    Asked asked(given);
    const Model<double> hand = lowered_by_hand(given);
    ASSERT_EQ(asked.robot.nv(), hand.nv());
    ASSERT_EQ(asked.robot.nq(), hand.nq());
    const DenseMechanics dense = dense_mechanics(hand, asked.state);
    EXPECT_LE((asked.mass() - dense.M).norm(), 1e-13 * dense.M.norm());
    EXPECT_LE((asked.bias() - dense.bias).norm(), 1e-12 * dense.bias.norm());
    const Energies energy = energies(model_of(given.build()), asked.state);
    EXPECT_NEAR(energy.kinetic / kinetic_energy(given, asked.state.q, asked.state.qd), 1, 1e-13);
  }
}

// One body on each axis, at any place in its parent, as hinge and slide.
TEST(ModelBuilder, AxesPointAnywhere) {
  for (const Vector& axis : axes())
    for (const JointType joint : {JointType::hinge, JointType::slide})
      for (int seed = 0; seed < 3; ++seed) {
        SCOPED_TRACE(testing::Message() << "axis " << axis.transpose() << " seed " << seed);
        Random random(seed);
        BodyParameters body = random_parameters(random, -1, joint);
        body.axis = plain(axis);
        BodyParameters second = random_parameters(random, 0, JointType::hinge);
        second.axis = plain(Vector(-axis));
        const Robot given{{body, second}};
        Asked asked(given);
        const VectorX<double>& qd = asked.state.qd;
        const MatrixX<double> M = asked.mass();
        EXPECT_NEAR(qd.dot(M * qd) / 2 / kinetic_energy(given, asked.state.q, qd), 1, 1e-13);
        const DenseMechanics dense = dense_mechanics(lowered_by_hand(given), asked.state);
        EXPECT_LE((M - dense.M).norm(), 1e-13 * dense.M.norm());
        EXPECT_LE((asked.bias() - dense.bias).norm(), 1e-12 * dense.bias.norm());

        // alone, by the theorem of parallel axes
        const Vector n = axis.normalized(), c = vector_of(body.center_of_mass);
        const double about_axis =
            n.dot(inertia_of(body) * n) + body.mass * n.cross(c).squaredNorm();
        const double own = joint == JointType::hinge ? about_axis : body.mass;
        EXPECT_NEAR(Asked({{body}}).mass()(0, 0), own + body.armature, 1e-14 * own);
      }
}

// Links with axes x, y, z and back are at right angles to the last bit, which the fast path uses.
TEST(ModelBuilder, AxesOfCoordinatesAreExact) {
  Random random(3);
  const int n = 6;
  Robot given;
  for (int k = 0; k < n; ++k) {
    BodyParameters body = random_parameters(random, k - 1, JointType::hinge);
    body.rotation = {1, 0, 0, 0};
    body.axis = plain(axes()[k]);
    given.bodies.push_back(body);
  }
  const ZeroTerms zeros = count_zero_terms(LoweredModel<double>(model_of(given.build())));
  EXPECT_EQ(zeros.links, n - 1);
  EXPECT_EQ(zeros.right_angles, n - 1);
}

// Masses m1, m2 at centres c1, c2 of links of length l1 and any, turning about parallel axes.
TEST(ModelBuilder, DoublePendulumIsThatOfTheTextbooks) {
  const double m1 = 2, m2 = 1.5, l1 = 0.8, c1 = 0.3, c2 = 0.45, I1 = 0.11, I2 = 0.07, g = 9.81;
  Robot given{.gravity = {0, 0, -g}};
  BodyParameters body;
  body.joint = JointType::hinge;
  body.axis = {0, -1, 0};  // so that a positive angle lifts +x
  body.mass = m1;
  body.center_of_mass = {c1, 0, 0};
  body.inertia = {0.05, I1, 0.1, 0, 0, 0};
  given.bodies.push_back(body);
  body.parent = 0;
  body.position = {l1, 0, 0};
  body.mass = m2;
  body.center_of_mass = {c2, 0, 0};
  body.inertia = {0.03, I2, 0.06, 0, 0, 0};
  given.bodies.push_back(body);
  for (int seed = 0; seed < 10; ++seed) {
    Asked asked(given, seed);
    const VectorX<double>&q = asked.state.q, &qd = asked.state.qd;
    Eigen::Matrix2d M;
    const double coupling = m2 * (c2 * c2 + l1 * c2 * std::cos(q[1])) + I2;
    M << m1 * c1 * c1 + I1 + m2 * (l1 * l1 + l1 * c2 * std::cos(q[1])) + coupling, coupling,
        coupling, m2 * c2 * c2 + I2;
    const double h = m2 * l1 * c2 * std::sin(q[1]), tip = m2 * c2 * g * std::cos(q[0] + q[1]);
    const Eigen::Vector2d bias(
        -h * qd[1] * (2 * qd[0] + qd[1]) + (m1 * c1 + m2 * l1) * g * std::cos(q[0]) + tip,
        h * qd[0] * qd[0] + tip);
    EXPECT_LE((asked.mass() - M).norm(), 1e-14 * M.norm());
    EXPECT_LE((asked.bias() - bias).norm(), 1e-13 * (1 + bias.norm()));
    EXPECT_NEAR(kinetic_energy(given, q, qd), qd.dot(M * qd) / 2, 1e-13 * M.norm());
  }
}

// Without friction or torques: E' = 0 along the motion.
TEST(ModelBuilder, EnergyIsConserved) {
  Random random(4);
  Robot given;
  for (int b = 0; b < 6; ++b)
    given.bodies.push_back(random_parameters(random, b - 1,
                                             b == 2   ? JointType::fixed
                                             : b == 3 ? JointType::slide
                                                      : JointType::hinge));
  Asked asked(given);
  const VectorX<double> zero = VectorX<double>::Zero(asked.robot.nv());
  VectorX<double> a = poisoned<double>(zero.size());
  const State<double>& s = asked.state;
  ASSERT_TRUE(asked.robot.forward_dynamics(s.q, s.qd, zero, a));
  const auto energy = [&](double t) {
    const VectorX<double> q = s.q + t * s.qd + t * t / 2 * a, qd = s.qd + t * a;
    return kinetic_energy(given, q, qd) + potential_energy(given, q);
  };
  const double h = 1e-5, power = (energy(h) - energy(-h)) / (2 * h);
  EXPECT_NEAR(power, 0, 1e-7 * a.norm() * s.qd.norm());
}

// A body's velocity in its own axes is J qd of its frame.
TEST(ModelBuilder, FramesAreThoseOfTheBodies) {
  for (int seed = 0; seed < 5; ++seed) {
    const Robot given = everything_by_hand(seed);
    const ModelBuilder builder = given.builder();
    std::vector<Frame> frames;
    for (std::size_t b = 0; b < given.bodies.size(); ++b) frames.push_back(builder.frame(b));
    DynamicsOptions options;
    options.question.want = {Want::operational, Want::inverse};
    options.question.frames = frames;
    Dynamics<double> robot(builder.build(), options);
    const int nv = robot.nv(), rows = 6 * static_cast<int>(frames.size());
    Random random(seed);
    const VectorX<double> q = random.vector(robot.nq());
    MatrixX<double> J(rows, nv), X(nv, nv), operational = poisoned<double>(rows, rows);
    for (int k = 0; k < nv; ++k) {
      const std::vector<Moving> moving = follow(given, q, VectorX<double>::Unit(nv, k));
      for (std::size_t b = 0; b < moving.size(); ++b) {
        J.col(k).segment<3>(6 * b) = moving[b].R.transpose() * moving[b].w;
        J.col(k).segment<3>(6 * b + 3) = moving[b].R.transpose() * moving[b].v;
      }
    }
    EXPECT_LE((frame_jacobian(model_of(builder.build()), q, frames) - J).norm(), 1e-13 * J.norm());
    ASSERT_TRUE(robot.inverse_mass(q, X));
    ASSERT_TRUE(robot.operational(q, operational));
    EXPECT_LE((operational - J * X * J.transpose()).norm(), 1e-12 * operational.norm());
    EXPECT_TRUE(J.topRows(12).isZero(0)) << "fixed to the base";
  }
}

}  // namespace
}  // namespace kalmarm::test
