// Implicit steps against mj_step of MuJoCo, with contacts, limits, constraints and actuators left out:
// a = (v+ - v) / h and q+ of the robots that ship, with dampers and springs from 1 to 1e7.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "algorithms/model/plain.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {
namespace {

using Mujoco = std::unique_ptr<mjModel, void (*)(mjModel*)>;

Mujoco bare(const mjModel* given, double h) {
  Mujoco m(mj_copyModel(nullptr, given), mj_deleteModel);
  m->opt.timestep = h;
  // Springs at the start of a step give accelerations above 1e10, at which MuJoCo starts anew.
  m->opt.disableflags |=
      mjDSBL_CONTACT | mjDSBL_CONSTRAINT | mjDSBL_ACTUATION | mjDSBL_AUTORESET;
  m->opt.density = m->opt.viscosity = 0;
  std::fill_n(m->body_gravcomp, m->nbody, 0.0);
  std::fill_n(m->tendon_stiffness, m->ntendon, 0.0);
  std::fill_n(m->tendon_damping, m->ntendon, 0.0);
  return m;
}

// The same terms in both: dampers everywhere, springs at hinges and slides, by decades.
JointTerms set_terms(mjModel* m) {
  std::mt19937_64 random(5);
  const auto decades = [&](double least, double most) {
    return std::pow(10, std::uniform_real_distribution<>(least, most)(random));
  };
  JointTerms out;
  out.stiffness.assign(m->nv, 0);
  out.reference.assign(m->nv, 0);
  for (int k = 0; k < m->nv; ++k) out.damping.push_back(m->dof_damping[k] = decades(-1, 4));
  for (int j = 0; j < m->njnt; ++j) {
    m->jnt_stiffness[j] = 0;
    if (m->jnt_type[j] != mjJNT_HINGE && m->jnt_type[j] != mjJNT_SLIDE) continue;
    out.stiffness[m->jnt_dofadr[j]] = m->jnt_stiffness[j] = decades(0, 7);
    out.reference[m->jnt_dofadr[j]] = m->qpos_spring[m->jnt_qposadr[j]] = decades(-2, 0);
  }
  return out;
}

class Steps : public testing::TestWithParam<std::string> {};

TEST_P(Steps, AreThoseOfMujoco) {
  const Scene scene = load_scene(GetParam());
  const double h = 0.002;
  const Mujoco m = bare(scene.mujoco->get(), h);
  const JointTerms terms = set_terms(m.get());
  const std::unique_ptr<mjData, void (*)(mjData*)> d(mj_makeData(m.get()), mj_deleteData);
  const RobotModel robot = plain(scene.model);
  const int nv = robot.nv();
  ASSERT_EQ(m->nv, nv);
  const std::pair<mjtIntegrator, Scheme> pairs[] = {
      {mjINT_EULER, Scheme::springs_at_start},
      {mjINT_IMPLICITFAST, Scheme::springs_at_start},
      {mjINT_DISCRETE, Scheme::springs_at_end}};
  for (const auto& [integrator, scheme] : pairs) {
    SCOPED_TRACE(static_cast<int>(integrator));
    m->opt.integrator = integrator;
    ImplicitStep<double> step(robot, h, terms, scheme);
    for (const State& state : random_states(scene, 5, 3)) {
      mj_resetData(m.get(), d.get());
      std::copy(state.q.begin(), state.q.end(), d->qpos);
      std::copy(state.qd.begin(), state.qd.end(), d->qvel);
      std::copy(state.tau.begin(), state.tau.end(), d->qfrc_applied);
      mj_step(m.get(), d.get());
      VectorX<double> q = state.q, v = state.qd, a(nv);
      ASSERT_TRUE(step.step(q, v, state.tau, a));
      const Eigen::Map<const VectorX<double>> theirs(d->qvel, nv), q_theirs(d->qpos, robot.nq);
      EXPECT_LE((v - theirs).norm(), 1e-12 * (state.qd.norm() + theirs.norm()));
      EXPECT_LE((a - (theirs - state.qd) / h).norm(), 1e-9 * a.norm());
      EXPECT_LE((q - q_theirs).norm(), 1e-12 * q_theirs.norm());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, Steps, testing::ValuesIn(shipped_robots()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace kalmarm
