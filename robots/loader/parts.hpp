// What moves a robot beyond M and the bias: actuators, tendons, forces of joints. Of a specification and
// of a compiled model alike, so that the same rules say of both what has terms of implicit steps and what
// is left out.
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

namespace kalmarm {

inline bool has_one_axis(int joint) { return joint == mjJNT_HINGE || joint == mjJNT_SLIDE; }
inline bool drives_joint(int transmission) {
  return transmission == mjTRN_JOINT || transmission == mjTRN_JOINTINPARENT;
}

struct TendonPart {
  std::string name;
  bool is_fixed = false, is_nonlinear = false, is_band = false;
  double stiffness = 0, damping = 0, armature = 0, yield = 0, friction = 0;
  bool is_driven = false;  // by actuators

  // What it is that is no row, such as "spatial tendon"; empty where it is one.
  std::string left_out() const;
  bool has_force() const;  // or armature, of its own
  bool is_row() const { return left_out().empty() && (has_force() || is_driven); }
};

struct ActuatorPart {
  std::string name;
  int transmission = mjTRN_UNDEFINED;
  std::string no_target;  // why it moves nothing that has terms: "actuator of a site"; else ""
  bool is_off = false;    // by the file itself
  bool is_plugin = false, is_dynamic = false, is_late = false, is_affine = true;
  bool has_nonlinear_damping = false;
  bool has_force_limit = false;  // or its tendon on all of them
  double armature = 0, damping = 0;

  // What it is that has no terms, such as "actuator of a site"; empty where it has.
  std::string left_out() const;
  bool drives_row() const { return transmission == mjTRN_TENDON && no_target.empty(); }
};

struct JointPart {
  bool is_single = false;  // a hinge or a slide
  double damping = 0, stiffness = 0, friction = 0;
  bool is_nonlinear = false;     // its spring or damper
  bool has_force_limit = false;  // on its actuators
};

// All in MuJoCo's order.
std::vector<TendonPart> tendon_parts(mjSpec* spec);
std::vector<TendonPart> tendon_parts(const mjModel* model);
std::vector<ActuatorPart> actuator_parts(mjSpec* spec);
std::vector<ActuatorPart> actuator_parts(const mjModel* model);

struct MovingParts {
  std::vector<int> equalities;  // types of the active ones
  std::vector<ActuatorPart> actuators;
  std::vector<TendonPart> tendons;
  std::vector<JointPart> joints;
  std::vector<double> gravcomp;  // of bodies
  int flexes = 0;
  bool has_drag = false;  // of a medium
};
MovingParts parts_of(mjSpec* spec);
MovingParts parts_of(const mjModel* model);

// Throws InputError where armature couples joints; of fixed tendons it may where whoever asks takes steps
// with their rows.
void refuse_coupling_armature(const std::vector<ActuatorPart>& actuators,
                              const std::vector<TendonPart>& tendons, bool takes_steps);

}  // namespace kalmarm
