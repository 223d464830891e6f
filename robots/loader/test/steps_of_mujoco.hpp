// A robot of all kinds of joints as MJCF, and its implicit steps against MuJoCo's own.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "algorithms/model/plain.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/loader/test/robot_text.hpp"
#include "robots/scene/mujoco_step.hpp"
#include "robots/scene/step_terms.hpp"

namespace kalmarm {

inline const LoadOptions steps = {.takes_steps = true};

inline std::string mujoco_text(const std::string& bodies, const std::string& rest = "") {
  return "<mujoco><compiler angle='radian' autolimits='true'/><worldbody>" + bodies +
         "</worldbody>" + rest + "</mujoco>";
}

// A shoulder, a slide with a spring and a damper, a ball, and a free body with a tail.
inline std::string arm(const std::string& rest, const std::string& bodies = "") {
  const auto inertia = [](double mass) {
    return "<inertial pos='.1 -.05 .2' mass='" + std::to_string(mass) +
           "' quat='.8 .1 -.3 .5' diaginertia='.03 .04 .05'/>";
  };
  return mujoco_text(
      "<body pos='.3 .2 -.1' quat='.5 -.4 .7 .3' " + bodies +
          "><joint name='shoulder' axis='0 1 0' ref='.3' armature='.02'/>" + inertia(1.3) +
          "<body pos='0 .1 .4' " + bodies +
          "><joint name='slide' type='slide' axis='1 0 1' damping='2' stiffness='300' "
          "springref='.1'/>" +
          inertia(.7) + "<body pos='0 0 .2'><joint name='wrist' type='ball'/>" + inertia(.4) +
          "</body></body></body><body name='free' " + bodies + "><freejoint/>" + inertia(2) +
          "<body pos='0 .3 0'><joint name='tail' axis='0 1 0'/>" + inertia(.2) + "</body></body>",
      rest);
}

inline std::string actuators(const std::string& inside) {
  return "<actuator>" + inside + "</actuator>";
}

// The largest difference of a, relative, in some states.
inline double distance_of_steps(const Scene& scene, Integrator integrator) {
  const RobotModel robot = plain(scene.model);
  const double h = 0.002;
  const StepTerms terms(scene, integrator);
  MujocoStep theirs(*scene.mujoco, h, joint_terms_of(scene), integrator);
  ImplicitStep<double> step(robot, h, terms.terms(), terms.scheme());
  double out = 0;
  for (const State& state : random_states(scene, 5, 3)) {
    theirs.step(state.q, state.qd, state.tau);
    VectorX<double> q = state.q, v = state.qd, a(robot.nv());
    const VectorX<double> tau = state.tau + terms.torque<double>(q, v);
    EXPECT_TRUE(step.step(q, v, tau, a));
    out = std::max(out, (a - (theirs.v() - state.qd) / h).norm() / a.norm());
    if (out < 1e-11) {
      EXPECT_LE((q - theirs.q()).norm(), 1e-12 * q.norm());
    }
  }
  return out;
}

// Against MuJoCo's own tendons, actuators and gravcomp, by all three integrators.
inline void expect_steps_of_mujoco(const std::string& text, const LoadOptions& options = steps) {
  const Scene scene = read(text, ".xml", options);
  for (const Integrator integrator : all_integrators)
    EXPECT_LE(distance_of_steps(scene, integrator), 1e-11) << to_string(integrator);
}

}  // namespace kalmarm
