// Couplings of joints of files as imposed rows of implicit steps: against dense equations with Lagrange
// multipliers, at the end of whole steps, and what is refused.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <string>
#include <vector>

#include "kalmarm/load.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/steps_of_mujoco.hpp"

namespace kalmarm {
namespace {

const LoadOptions imposing = {.imposes_couplings = true, .takes_steps = true};

std::string equality(const std::string& inside) { return "<equality>" + inside + "</equality>"; }

// The slide follows the shoulder, the tail stands; one coupling is not active.
std::string coupled_arm(const std::string& more = "") {
  return arm(more + equality("<joint joint1='slide' joint2='shoulder' polycoef='.05 -1.5 0 0 0'/>"
                             "<joint joint1='tail' polycoef='.4 0 0 0 0'/>"
                             "<joint joint1='tail' joint2='slide' active='false'/>"));
}

// M^ a + J' f = tau^ - bias,  J a = -(J q - l0 + h J v) / h^2.
VectorX<double> by_multipliers(const Scene& scene, const StepTerms& terms, const State& state,
                               double h) {
  const RobotModel robot = plain(scene.model);
  const int nv = robot.nv(), m = static_cast<int>(terms.terms().rows.size());
  Dynamics<double> dynamics(robot);
  MatrixX<double> M(nv, nv), K = MatrixX<double>::Zero(nv + m, nv + m);
  VectorX<double> bias(nv), right(nv + m);
  dynamics.mass(state.q, M);
  dynamics.bias(state.q, state.qd, bias);
  right.head(nv) = state.tau + terms.torque<double>(state.q, state.qd) - bias;
  for (int k = 0; k < nv; ++k) {
    const double b = terms.terms().damping[k], s = terms.terms().stiffness[k];
    M(k, k) += h * (b + h * s);
    right[k] -= b * state.qd[k];
    if (s > 0)
      right[k] -=
          s * (state.q[robot.links[k].q_index] - terms.terms().reference[k] + h * state.qd[k]);
  }
  K.topLeftCorner(nv, nv) = M;
  for (int i = 0; i < m; ++i) {
    const CoupledRow& row = terms.terms().rows[i];
    EXPECT_TRUE(row.imposed);
    double length = -row.reference;
    for (int k = 0; k < nv; ++k) {
      K(nv + i, k) = K(k, nv + i) = row.jacobian[k];
      if (row.jacobian[k] != 0)
        length += row.jacobian[k] * (state.q[robot.links[k].q_index] + h * state.qd[k]);
    }
    right[nv + i] = -length / (h * h);
  }
  return K.fullPivLu().solve(right).head(nv);
}

TEST(ImposedRows, SolveTheEquationsWithMultipliers) {
  const double h = 0.002;
  const Scene scene =
      read(coupled_arm(actuators("<position joint='slide' kp='50' kv='2'/>")), ".xml", imposing);
  EXPECT_EQ(scene.mujoco->notes(), Notes{});
  const StepTerms terms(scene, Integrator::discrete);
  ASSERT_EQ(terms.terms().rows.size(), 2);
  ImplicitStep<double> step(plain(scene.model), h, terms.terms(), terms.scheme());
  for (const State& state : random_states(scene, 5, 7)) {
    VectorX<double> q = state.q, v = state.qd, a(scene.model.nv());
    const VectorX<double> right = by_multipliers(scene, terms, state, h);
    const VectorX<double> tau = state.tau + terms.torque<double>(state.q, state.qd);
    ASSERT_TRUE(step.step(q, v, tau, a));
    EXPECT_LE((a - right).norm(), 1e-10 * right.norm());
    const double shoulder = q[0] - .3, tail = q[scene.model.nq() - 1];
    EXPECT_NEAR(q[1], .05 - 1.5 * shoulder, 1e-12);
    EXPECT_NEAR(tail, .4, 1e-12);
  }
}

TEST(ImposedRows, OfAMimicJointAreThoseOfTheUrdf) {
  const std::string text = urdf(
      link("base", "") + link("a", body_of(2)) + link("b", body_of(1)) +
      joint("left", "revolute", "base", "a") +
      joint("right", "revolute", "base", "b", "<mimic joint='left' multiplier='-2' offset='.1'/>"));
  const TemporaryFile file(text, ".urdf");
  const LoadedRobot robot = load_robot(file.path(), imposing);
  ASSERT_EQ(robot.terms.rows.size(), 1);
  EXPECT_TRUE(robot.terms.rows[0].imposed);
  const std::vector<double>& J = robot.terms.rows[0].jacobian;
  EXPECT_EQ(J[robot.dof("left")] / J[robot.dof("right")], 2);
  EXPECT_EQ(robot.terms.rows[0].reference / J[robot.dof("right")], .1);
  EXPECT_TRUE(load_robot(file.path(), steps).terms.rows.empty());
}

// After those of tendons, which stay as they are.
TEST(ImposedRows, StandBesideTendons) {
  const std::string tendon =
      "<tendon><fixed name='t' damping='3'><joint joint='slide' coef='2'/></fixed></tendon>";
  const Scene scene = read(coupled_arm(tendon), ".xml", imposing);
  const std::vector<CoupledRow> rows = joint_terms_of(scene).rows;
  ASSERT_EQ(rows.size(), 3);
  EXPECT_EQ(rows[0].damping, 3);
  EXPECT_FALSE(rows[0].imposed);
  EXPECT_TRUE(rows[1].imposed && rows[2].imposed);
}

TEST(ImposedRows, AreRefusedWhereTheyCannotBe) {
  const auto refused = [](const std::string& inside, const std::vector<std::string>& words) {
    const std::string text = arm(equality(inside));
    expect_refused([&] { read(text, ".xml", imposing); }, words);
    EXPECT_NO_THROW(read(text, ".xml", steps));
  };
  refused("<joint joint1='slide' joint2='shoulder' polycoef='0 1 .5 0 0'/>",
          {"'slide'", "not linear"});
  refused("<joint joint1='slide' joint2='slide' polycoef='0 1 0 0 0'/>", {"'slide'", "to itself"});
}

}  // namespace
}  // namespace kalmarm
