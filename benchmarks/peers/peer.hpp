// What a contender of bench_peers can do: another library, or our own code built by another
// compiler.
//
// Contenders are modules, shared objects that export `kalmarm_peers` alone: so each is compiled by
// the compiler and with the flags that suit it. Only plain numbers cross the border, since the
// alignment of Eigen's types depends on the flags.
//
// States and results are given in Kalmarm's conventions: joints in the order of the model, a free
// joint's velocity is the linear one in the world's axes, then the angular one in the body's. A
// contender keeps them in its own, so that no timed call converts any.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace kalmarm {

template <class T>
class Model;

struct Mechanism {
  enum class Type { hinge, slide, ball, free };

  // A joint and the body that it moves. The body's frame is the joint's: a hinge or slide has its z
  // axis. Matrices are row-major.
  struct Joint {
    Type type;
    int parent;                       // joint on the inboard side, -1: the fixed base
    int q, v, dof;                    // first entries of q and of velocities, number of the latter
    double R[9], p[3];                // its frame in the parent body's at q = ref [m]
    double ref;                       // of a hinge or slide [rad or m]
    double armature;                  // the same for all its DoF [kg m^2 or kg]
    double mass, com[3], inertia[9];  // inertia: about the com [kg, m, kg m^2]
  };

  std::vector<Joint> joints;
  int nq = 0, nv = 0;
  double gravity[3] = {};                // [m/s^2]
  const Model<double>* model = nullptr;  // for modules that are built with Kalmarm's own flags

  bool is_chain() const {
    for (std::size_t i = 0; i < joints.size(); ++i)
      if (joints[i].parent != static_cast<int>(i) - 1) return false;
    return true;
  }
  int last_dof(int joint) const { return joints[joint].v + joints[joint].dof - 1; }
  // The first two joints whose bodies carry no other, as far as there are two: the feet of a humanoid.
  std::vector<int> tips() const {
    std::vector<char> carries(joints.size(), 0);
    for (const Joint& joint : joints)
      if (joint.parent >= 0) carries[joint.parent] = 1;
    std::vector<int> out;
    for (std::size_t i = 0; i < joints.size() && out.size() < 2; ++i)
      if (!carries[i]) out.push_back(static_cast<int>(i));
    return out;
  }
  bool has_only_hinges_and_slides() const {
    for (const Joint& joint : joints)
      if (joint.type == Type::ball || joint.type == Type::free) return false;
    return true;
  }
};

enum class Task {
  acceleration,
  inverse_dynamics,
  inverse,
  mass,
  derivatives,
  inverse_triangle,
  mass_triangle,
  frame,        // the last body's: its pose and J, in the base's axes
  momentum,     // the centroidal momentum matrix and the centre of mass
  operational,  // J M^-1 J' of the tips, in their own axes
  regressor     // of torques, by the inertial parameters of all bodies
};

// What most libraries have.
inline bool is_common(Task task) {
  return task == Task::acceleration || task == Task::inverse_dynamics || task == Task::inverse ||
         task == Task::mass;
}

inline bool is_kinematics(Task task) { return task == Task::frame || task == Task::momentum; }

// One triangle of a symmetric matrix is enough.
inline bool is_triangle(Task task) {
  return task == Task::inverse_triangle || task == Task::mass_triangle;
}

class Peer {
 public:
  virtual ~Peer() = default;

  virtual std::string name() const = 0;     // such as "Pinocchio<LOCAL>@clang"
  virtual std::string version() const = 0;  // of the library, and how it was built; "" for ours
  virtual bool can(Task task) const = 0;
  virtual bool is_float32() const { return false; }
  virtual bool has_armature() const { return true; }  // else it solves the mechanism without

  // Of a state, in a call for it alone or in batch(task); 0: not known.
  virtual double flops(Task, bool /*batch*/) const { return 0; }
  // CPU seconds of generating and compiling code for the task, once it was called; 0: no such code.
  virtual double seconds_to_generate(Task) const { return 0; }

  // One more state for the calls to work on.
  virtual void add_state(const double* q, const double* qd, const double* tau) = 0;

  // Whether batch(task) is a call of its own, whose results stay side by side.
  virtual bool has_batch(Task) const { return false; }

  // The timed calls, of state i or, `batch`, of all; false where they failed. acceleration and derivatives
  // take q, qd and tau; inverse_dynamics and regressor take q, qd and, with tau's numbers, qdd; inverse and mass
  // take q, and so do frame, momentum and operational. Both triangles are filled, or by TASK_triangle at least the one that the library fills.
  virtual bool acceleration(int) { return false; }
  virtual bool inverse_dynamics(int) { return false; }
  virtual bool inverse(int) { return false; }
  virtual bool mass(int) { return false; }
  virtual bool inverse_triangle(int) { return false; }
  virtual bool mass_triangle(int) { return false; }
  virtual bool derivatives(int) { return false; }
  virtual bool frame(int) { return false; }
  virtual bool momentum(int) { return false; }
  virtual bool operational(int) { return false; }
  virtual bool regressor(int) { return false; }
  virtual bool batch(Task task) {
    for (int i = 0; i < states(); ++i)
      if (!call(task, i)) return false;
    return true;
  }
  bool call(Task task, int i) {
    switch (task) {
      case Task::acceleration:
        return acceleration(i);
      case Task::inverse_dynamics:
        return inverse_dynamics(i);
      case Task::inverse:
        return inverse(i);
      case Task::inverse_triangle:
        return inverse_triangle(i);
      case Task::mass:
        return mass(i);
      case Task::mass_triangle:
        return mass_triangle(i);
      case Task::derivatives:
        return derivatives(i);
      case Task::frame:
        return frame(i);
      case Task::momentum:
        return momentum(i);
      case Task::operational:
        return operational(i);
      case Task::regressor:
        return regressor(i);
    }
    return false;
  }

  // What the last call for state i has left, in Kalmarm's conventions; matrices are nv x nv,
  // row-major. `matrix` is M^-1 or M, whichever was asked for last, whole.
  virtual void get_acceleration(int, double*) const {}
  virtual void get_torque(int, double*) const {}  // of inverse_dynamics
  // By the last regressor: its product with the parameters, and what armature adds.
  virtual void get_regressed_torque(int, double*) const {}
  virtual void get_matrix(int, double*) const {}
  virtual void get_columns(int, double*) const {
  }  // of frame or momentum, 6 x nv, (angular; linear)
  virtual void get_operational(int, double*) const {
  }  // 6 rows and columns a tip, (angular; linear)
  virtual void get_derivatives(int, double* /*dq*/, double* /*dqd*/, double* /*dtau*/) const {}

 protected:
  virtual int states() const = 0;
};

// Of the module that asks.
#ifdef __clang__
inline constexpr const char *compiler_name = "clang", *compiler_version = __clang_version__;
#else
inline constexpr const char *compiler_name = "gcc", *compiler_version = __VERSION__;
#endif

using Peers = std::vector<std::unique_ptr<Peer>>;

}  // namespace kalmarm

// Adds those of the module that can do something with the mechanism, which outlives them.
extern "C" [[gnu::visibility("default")]] void kalmarm_peers(const kalmarm::Mechanism& mechanism,
                                                             kalmarm::Peers& peers);
