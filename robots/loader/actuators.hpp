// Actuators of a file as springs, dampers and torques of implicit steps (kalmarm/implicit_step.hpp).
//
// On a hinge or slide with gear G, at a control u, with a gain of g0 + g1 l + g2 l' and a bias of
// b0 + b1 l + b2 l' by the length l = G q, MuJoCo's force is (g0 + g1 l + g2 l') u + b0 + b1 l + b2 l',
// and the joint feels G times as much:
//   G (g0 u + b0) - k q - b q',  k = -G^2 (g1 u + b1),  b = -G^2 (g2 u + b2)                (1)
// Together with the joint's own spring k_j about q_j that is a spring and a constant torque,
//   K = k_j + sum k,  K q0 = k_j q_j + sum of G (g0 u + b0) where k > 0,
//   torque = sum of G (g0 u + b0) where k = 0                                              (2)
// On a fixed tendon (tendons.hpp) all that is along its length J q: the row's spring and damper, and
// torques J' G (g0 u + b0).
// What an actuator has by its attributes `armature` and `damping` is its joint's own, times G^2.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <string>
#include <vector>

#include "algorithms/spatial/spatial.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/parts.hpp"

namespace kalmarm {

// Leaves of an actuator what it adds to its joint's armature and damping.
void mute(mjsActuator* actuator);
void mute(mjModel* model, int actuator);

struct Control {
  mjsElement* actuator;
  double value;
};

// Of the actuators that have terms: from `options`, else from the keyframe, else zero. Throws
// InputError where the options name an actuator that there is not or that has no terms, and where a
// value is not finite. Ask it before strip().
std::vector<Control> controls_of(mjSpec* spec, const LoadOptions& options);

// Of a compiled model, one an actuator, within their limits.
VectorX<double> limited_controls(const mjModel* model, const std::vector<Control>& controls);

// The same of MuJoCo's ctrl; zero of actuators without terms, which have other inputs.
VectorX<double> limited_controls(const mjModel* model, const std::vector<ActuatorPart>& actuators,
                                 const VectorX<double>& ctrl);

// Position actuators whose damper is told by its ratio to the critical one.
struct DampingRatio {
  mjsElement* actuator;
  double value;
};
std::vector<DampingRatio> damping_ratios(mjSpec* spec);  // ask it before compiling

// Their dampers by the diagonal of M where the model starts, whose bodies are not those that MuJoCo
// compiled.
void set_dampers(const std::vector<DampingRatio>& ratios, const VectorX<double>& M0,
                 mjModel* model);

// Mutes the actuators that would push a joint away: no implicit step has a negative spring or damper.
// How many these are.
int mute_destabilising(mjModel* model, const VectorX<double>& controls);

// (1), in MuJoCo's order; without those that are muted. Throws InputError where a number is not finite.
std::vector<Actuator> actuators_of(const mjModel* model, const VectorX<double>& controls);

// Of what the actuators of a joint exert together, of every DoF.
std::vector<std::array<double, 2>> force_ranges(const mjModel* model);

// The joints' own terms, all of every DoF.
JointTerms joint_terms(const mjModel* model);

// (2)
struct Driven {
  JointTerms terms;
  std::vector<double> torque;  // nv
};
Driven driven(JointTerms joints, const std::vector<Actuator>& actuators);

}  // namespace kalmarm
