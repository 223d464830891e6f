// A scene is what the programs work on: a robot from a file, a robot that ships with Kalmarm, or a
// member of a family.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/model.hpp"
#include "robots/loader/mujoco_model.hpp"

namespace kalmarm {

struct State {
  VectorX<double> q, qd, tau;  // nq, nv, nv
};

struct Scene {
  std::string name;  // with its size: "panda:9", "chain:31"
  Model<double> model;
  std::shared_ptr<const MujocoModel> mujoco;  // null for a family until mujoco_of() is called
  std::vector<std::array<double, 2>> range;   // of every entry of q; quaternions are drawn apart
  std::string file;                           // empty for a family
  LoadOptions read = {};                      // how it was read
  bool at_rest = false;                       // q = 0 and qd = 0 belong to the scene
};

// `what` is the path of an MJCF or URDF file, the name of a folder in robots/ or of a file in
// robots/models/scenes/ (with or without its size), or family:N, which takes no options. Throws InputError.
Scene load_scene(const std::string& what, const LoadOptions& read = {});

// A model made by the program: positions between -pi and pi.
Scene generated_scene(const std::string& name, const Model<double>& model);

// q (nq) as the scene's file or its keyframe starts; of a family every joint at its reference.
VectorX<double> home_position(const Scene& scene);
State home_state(const Scene& scene);  // with the keyframe's velocities, else at rest; tau = 0

// Names that load_scene knows without a path.
std::vector<std::string> shipped_robots();
std::vector<std::string> shipped_scenes();  // of several robots and things

// States from a seed, the same on every machine: joint positions uniform within their limits (-pi
// to pi and -1/2 m to 1/2 m where there are none below 1e6), orientations uniform, free bodies
// within 1 m, velocities and torques N(0,1).
std::vector<State> random_states(const Scene& scene, int count, std::uint64_t seed);

// Friction of the joints as the robot's file has it: viscous [N m s or N s/m] and Coulomb [N m or
// N] (nv each); zero for a family. No solver here adds it.
struct JointFriction {
  VectorX<double> viscous, coulomb;
};
JointFriction friction_of(const Scene& scene);

// Springs and dampers of the joints as the robot's file has them, without actuators; none for a family.
JointTerms joint_terms_of(const Scene& scene);

// The body of link k as people call it: the file's body that carries the joint, the DoF's name
// where there is none (a family, a link between the DoF of a joint of several).
std::string link_name(const Scene& scene, int k);

// Where the frame of that body stands in the axes of link k; there itself where there is no body.
LinkFrame frame_of_body(const Scene& scene, int k);

// The same mechanism in MuJoCo. Throws InputError where MuJoCo cannot hold it.
std::shared_ptr<const MujocoModel> mujoco_of(const Scene& scene);

}  // namespace kalmarm
