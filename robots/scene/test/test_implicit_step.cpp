// Implicit steps against mj_step of MuJoCo: a = (v+ - v) / h and q+ of the robots that ship, with dampers
// to 1e4 and springs from 1 to 1e7.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "algorithms/model/plain.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/scene/mujoco_step.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {
namespace {

JointTerms some_terms(const RobotModel& robot) {
  std::mt19937_64 random(5);
  const auto decades = [&](double least, double most) {
    return std::pow(10, std::uniform_real_distribution<>(least, most)(random));
  };
  JointTerms out;
  for (const LinkParameters& link : robot.links) {
    out.damping.push_back(decades(-1, 4));
    out.stiffness.push_back(takes_spring(link) ? decades(0, 7) : 0);
    out.reference.push_back(decades(-2, 0));
  }
  return out;
}

class Steps : public testing::TestWithParam<std::string> {};

TEST_P(Steps, AreThoseOfMujoco) {
  const Scene scene = load_scene(GetParam());
  const double h = 0.002;
  const RobotModel robot = plain(scene.model);
  const JointTerms terms = some_terms(robot);
  for (const Integrator integrator : all_integrators) {
    SCOPED_TRACE(to_string(integrator));
    MujocoStep theirs(*scene.mujoco, h, terms, integrator);
    ImplicitStep<double> step(robot, h, terms, StepTerms(scene, integrator).scheme());
    for (const State& state : random_states(scene, 5, 3)) {
      theirs.step(state.q, state.qd, state.tau);
      VectorX<double> q = state.q, v = state.qd, a(robot.nv());
      ASSERT_TRUE(step.step(q, v, state.tau, a));
      EXPECT_LE((v - theirs.v()).norm(), 1e-12 * (state.qd.norm() + v.norm()));
      EXPECT_LE((a - (theirs.v() - state.qd) / h).norm(), 1e-9 * a.norm());
      EXPECT_LE((q - theirs.q()).norm(), 1e-12 * q.norm());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, Steps, testing::ValuesIn(shipped_robots()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace kalmarm
