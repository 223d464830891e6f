// Kinematics: where a robot's frames and its mass are, and how they move.
//
//   kalmarm::Kinematics<double> kinematics(model, {tool, foot});
//   kinematics.compute(q, qd, {.axes = kalmarm::Axes::local, .jacobians = Jt, .velocities = V});
//
// All that is asked of one state comes from one sweep from the base to the tips; what is left out of the
// results is not worked out. A frame (robot_model.hpp) is any place on a link, or on the fixed base.
// F: their number. Spatial vectors are (angular; linear), as everywhere in Kalmarm.
//
// A velocity is J qd, an acceleration J qdd + dJ/dt qd with the same J, so that with qdd = 0 it is dJ/dt qd. The axes
// (robot_model.hpp) say which J (Pinocchio's names):
//
//   Axes      Pinocchio            angular   linear velocity   linear acceleration
//   local     LOCAL                R^T w     R^T v             R^T (a - w x v)      spatial, of the frame's axes
//   world     WORLD                w         v - w x p         a - z x p - w x v    spatial, at the base's origin
//   aligned   LOCAL_WORLD_ALIGNED  w         v                 a                    classical
//
// with R and p the frame's pose, w and z its angular velocity and acceleration, v and a the velocity and
// acceleration of its origin, all in the base's axes. Gravity is no part of an acceleration. mj_jac of MuJoCo is `aligned`,
// with the linear rows in jacp.
//
// Errors: nothing is solved for, so that every result has a bound and no outcome is needed. With s the sum of
// the lengths on the way from the frame's tree's root, positions are right to about n u (s + |root|),
// Jacobians in local and aligned axes to n u s wherever the robot stands, `world` to n u |p|. A state that
// is not finite gives results that are not, in its own row alone.
//
// Sizes are checked at every call: std::invalid_argument names the call and both sizes. Memory is taken
// when the object is made; the first call of rows, one on more threads than before, and the first for C or Y take more. One
// thread at a time may use an object. One state of Kinematics<float> is worked out in double.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "kalmarm/export.hpp"
#include "kalmarm/robot_model.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

// Each may be left out. View: MatrixView<T>, column-major, of one state; of rows of states, one in a row,
// std::optional<RowsView<T>>, of which a row has the columns of one state's matrix after each other.
template <class View>
struct KinematicResults {
  Axes axes = Axes::aligned;  // of jacobians, velocities and accelerations

  // --- of the frames
  View positions = {};      // 3 x F: p [m]
  View rotations = {};      // 3 x 3F: R, three columns a frame
  View quaternions = {};    // 4 x F: of R, (w, x, y, z), w >= 0
  View jacobians = {};      // nv x 6F: the transpose of J, six columns a frame, as solves take it
  View velocities = {};     // 6 x F [rad/s; m/s]
  View accelerations = {};  // 6 x F [rad/s^2; m/s^2]

  // --- of all bodies, in the base's axes; c: the centre of mass
  View center = {};               // 3: c [m]; NaN where nothing has a mass
  View center_velocity = {};      // 3: dc/dt [m/s]
  View center_acceleration = {};  // 3: d^2c/dt^2 [m/s^2]
  View center_jacobian = {};      // nv x 3: the transpose of J, dc/dt = J qd
  View momentum = {};             // 6: angular about c, linear: A qd [N m s; N s]
  View momentum_rate = {};        // 6: A qdd + dA/dt qd [N m; N]
  View momentum_matrix = {};      // nv x 6: the transpose of A (centroidal momentum matrix)
  View kinetic_energy = {};       // 1: qd' M qd / 2, rotors (armature) included [J]
  View potential_energy = {};     // 1: zero at the base's origin [J]

  // --- of inverse dynamics
  // nv x nv: C of tau = M qdd + C qd + gravity; dM/dt - 2 C is skew-symmetric.
  View coriolis = {};
  // nv x 10 B: Y of tau = Y pi + r qdd, gravity included, with pi(k) = (m, m c, Ixx, Iyy, Izz, Ixy, Ixz, Iyz) of
  // every link, or of the B that were chosen, about its origin in its axes, and r the armatures. da/dpi = -M^-1 Y
  // with Y at qdd = a: Dynamics::solve takes its columns.
  View regressor = {};
};

template <class T>
using StateKinematics = KinematicResults<MatrixView<T>>;
template <class T>
using RowsOfKinematics = KinematicResults<std::optional<RowsView<T>>>;

template <class T>
class KinematicsEngine;
class Threads;

template <class T>
class KALMARM_EXPORT Kinematics {
 public:
  // bodies: the links whose parameters the regressor is by, in its order; empty: all. Throws
  // std::invalid_argument where a frame or body is on a link that is not there, a frame has no axes, and where
  // the model is what no robot can be, as Dynamics does.
  explicit Kinematics(const RobotModel& model, const std::vector<Frame>& frames = {},
                      std::vector<int> bodies = {});
  ~Kinematics();
  Kinematics(Kinematics&&) noexcept;
  Kinematics& operator=(Kinematics&&) noexcept;

  int nq() const { return nq_; }
  int nv() const { return nv_; }
  int frames() const { return frames_; }
  double mass() const { return mass_; }  // of all bodies [kg]

  // From q (nq) and, for what moves, qd (nv) and qdd (nv; without it zero). About 60 flops a link on the
  // way to a frame, 45 more with velocities, 12 more an entry of J that is not zero; 250 a link for what all bodies
  // have. Velocities without qd: std::invalid_argument.
  void compute(VectorView<const T> q, const StateKinematics<T>& out) {
    of_state(q, nullptr, nullptr, out);
  }
  void compute(VectorView<const T> q, VectorView<const T> qd, const StateKinematics<T>& out) {
    of_state(q, &qd, nullptr, out);
  }
  void compute(VectorView<const T> q, VectorView<const T> qd, VectorView<const T> qdd,
               const StateKinematics<T>& out) {
    of_state(q, &qd, &qdd, out);
  }

  // The same of rows of states, on `threads` cores.
  void compute_rows(RowsView<const T> q, const RowsOfKinematics<T>& out, int threads = 1) {
    of_rows(q, nullptr, nullptr, out, threads);
  }
  void compute_rows(RowsView<const T> q, RowsView<const T> qd, const RowsOfKinematics<T>& out,
                    int threads = 1) {
    of_rows(q, &qd, nullptr, out, threads);
  }
  void compute_rows(RowsView<const T> q, RowsView<const T> qd, RowsView<const T> qdd,
                    const RowsOfKinematics<T>& out, int threads = 1) {
    of_rows(q, &qd, &qdd, out, threads);
  }

 private:
  void of_state(const VectorView<const T>& q, const VectorView<const T>* qd,
                const VectorView<const T>* qdd, const StateKinematics<T>& out);
  void of_rows(const RowsView<const T>& q, const RowsView<const T>* qd,
               const RowsView<const T>* qdd, const RowsOfKinematics<T>& out, int threads);
  KinematicsEngine<T>& engine() const;  // throws std::logic_error where it was moved away

  int nq_ = 0, nv_ = 0, frames_ = 0, bodies_ = 0;
  double mass_ = 0;
  std::unique_ptr<KinematicsEngine<T>> engine_;
  std::unique_ptr<Threads> threads_;
};

}  // namespace kalmarm
