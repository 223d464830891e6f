// Robots from MJCF and URDF files, through MuJoCo: component `robots` of the CMake package.
//
//   kalmarm::LoadedRobot robot = kalmarm::load_robot("g1.xml");
//   kalmarm::Dynamics<double> dynamics(robot.model);
//
// Of the file what M and the bias depend on is read: bodies, joints, inertias, armature, gravity;
// and, for implicit steps, springs, dampers, actuators and compensation of gravity. Notes name the
// rest. Meshes need not be there unless an inertia comes from them. Joints keep MuJoCo's order and
// conventions: entry i of q is qpos[i], DoF k is qvel[k].
#pragma once

#include <array>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "kalmarm/constraint.hpp"
#include "kalmarm/export.hpp"
#include "kalmarm/implicit_step.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

// What a URDF's link without <inertial> weighs: nothing, as ROS has it; its collision geometry at
// 1000 kg/m^3, as MuJoCo has it; or that where its mesh files are there, and else nothing.
enum class UrdfInertia { where_found, none, geometry };

// Inertias that no solid body has: with principal moments A <= B < C - A, or without a mass, they are
// taken as given, and with a negative moment and a mass refused; or all are made those of the nearest
// solid body.
enum class InertiaPolicy { given, balanced };

// How a file is read where there is more than one way. What is not named is as the file has it.
struct LoadOptions {
  // The root link that gets a free joint, "floating_base": a legged robot's URDF cannot say that its
  // base is not welded to the world. "" is the only root.
  std::optional<std::string> floating = {};

  UrdfInertia urdf_inertia = UrdfInertia::where_found;
  InertiaPolicy inertia = InertiaPolicy::given;

  // Folders that hold ROS packages, or are one, for meshes that are named package://PACKAGE/PATH;
  // before ROS_PACKAGE_PATH, AMENT_PREFIX_PATH and the folders above the file.
  std::vector<std::string> package_path = {};

  // The keyframe that is `home`, by name.
  std::string key = {};

  // Of actuators, by name, in the place of the keyframe's, or zero: LoadedRobot::terms hold them.
  std::map<std::string, double> controls = {};

  // What rotors and gears add to M, by joint: rotor inertia times gear ratio squared [kg m^2, of a
  // slide kg], for each DoF of the joint. In the place of what the file says of it.
  std::map<std::string, double> armature = {};

  // Whoever asks imposes the couplings of joints: no note says that they are ignored. With takes_steps
  // those that are linear are imposed rows of LoadedRobot::terms, after those of tendons; one that is
  // not is refused.
  bool imposes_couplings = false;

  // Whoever asks adds damping and friction of the joints itself: no note says that they are ignored.
  bool adds_friction = false;

  // Whoever asks takes implicit steps with LoadedRobot::terms and what stands beside them: no note
  // says that these are ignored. Tendons may have armature, which is in their rows and not in the
  // model; without this option such a file is refused.
  bool takes_steps = false;

  // Whoever asks keeps the forces of actuators on joints within Actuator::force_range and
  // LoadedRobot::force_range, which are infinite without this option: no note says that limits are
  // ignored.
  bool limits_forces = false;

  // Whoever asks takes LoadedRobot::constraints: no note says that they are ignored. Couplings of joints
  // are among them unless imposes_couplings takes those.
  bool takes_constraints = false;

  // A JSON file of LoadedRobot::constraints after those of the robot's file, as a URDF's loops need: docs/contacts.md says what it
  // holds. It is taken whatever takes_constraints is.
  std::string constraints = {};

  bool operator==(const LoadOptions&) const = default;
};

struct NamedFrame {
  std::string name;
  Frame frame;
};

// An actuator of the file on a hinge, a slide or a fixed tendon, whose force is affine in the length q,
// its rate and its control u: it moves its DoF, or along its tendon's J, by
// gain u + constant - stiffness q - damping q', within its force limits. An actuator at a limit is the
// force of that limit, without stiffness and damping.
struct Actuator {
  std::string name;                   // "" where the file has none
  int dof = -1;                       // -1 where it is on a tendon,
  int row = -1;                       // which is that of LoadedRobot::terms
  double control = 0;                 // u, within the file's limits of it
  double gain = 0, constant = 0;      // [N m or N], of a unit of u
  double stiffness = 0, damping = 0;  // as JointTerms; of a gain by length or velocity at this u,
  double stiffness_by_control = 0, damping_by_control = 0;  // and how they change with it
  std::array<double, 2> control_range = {-limitless, limitless};
  std::array<double, 2> force_range = {-limitless, limitless};  // [N m or N], of the joint

  static constexpr double limitless = std::numeric_limits<double>::infinity();
};

struct LoadedRobot {
  std::string name;  // the file's, without folder and ending
  RobotModel model;  // DoF are named after their joints: "knee"; of several DoF "ball:x", ...
  std::vector<double> home;           // q (nq) as the file or its keyframe starts
  std::vector<double> home_velocity;  // qd (nv) of the keyframe, else zero

  // Of every entry of q, for random states: a joint's limits, else +-pi of hinges and +-0.5 m of slides;
  // +-1 of free positions [m] and of quaternions, which are normalized.
  std::vector<std::array<double, 2>> range;

  // For ImplicitStep: linear dampers, springs of hinges and slides, a row a fixed tendon, and actuators
  // at their controls. An actuator without stiffness is a torque (nv), to be added to tau. For other
  // controls add gain (u - control) at the actuator's DoF, or times its row's jacobian.
  JointTerms terms;
  std::vector<double> torque;
  std::vector<Actuator> actuators;
  std::vector<std::array<double, 2>>
      force_range;  // (nv), of what actuators exert together [N m or N]

  // For ConstrainedDynamics: connect, weld and joint of MJCF that are active, <mimic> of URDF, as soft as solref and solimp
  // make them, where an option takes them, and those of the file LoadOptions::constraints. Those without a name are called by what
  // they hold, "rod-foot". A note says which are open at home, and how far.
  std::vector<Constraint> constraints;

  // Where the file compensates gravity (gravcomp): the robot of these weights alone. Its inverse
  // dynamics at q, at rest, are the torque that bears them, to be added to tau.
  std::optional<RobotModel> compensated;

  // Those with a name: the file's sites, then its bodies and links, "world" first, also those that are
  // welded to others. A body's is where its children stand.
  std::vector<NamedFrame> frames;
  // What an engineer should know of the file, each a line: what it holds beyond M and the bias
  // ("ignored: 2 connect constraints, 7 actuators"), and inertias that no solid body has, taken as given.
  std::vector<std::string> notes;

  // Of several frames of this name the first is taken. Throws std::invalid_argument, with the nearest
  // names, where there is none.
  KALMARM_EXPORT const Frame& frame(const std::string& frame_name) const;

  // The first DoF of a joint. Throws std::invalid_argument where there is none of this name.
  KALMARM_EXPORT int dof(const std::string& joint) const;
};

// Throws std::runtime_error, in one line with the file, the element and the reason.
KALMARM_EXPORT LoadedRobot load_robot(const std::string& path, const LoadOptions& options = {});

}  // namespace kalmarm
