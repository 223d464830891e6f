// What answers for the kinematics of a robot: results as plain numbers, compiled once a scalar and an
// instruction set.
#pragma once

#include <algorithm>
#include <array>
#include <initializer_list>
#include <memory>
#include <vector>

#include "kalmarm/kinematics.hpp"

namespace kalmarm {

// In the order of KinematicResults.
enum class Kinematic {
  positions,
  rotations,
  quaternions,
  jacobians,
  velocities,
  accelerations,
  center,
  center_velocity,
  center_acceleration,
  center_jacobian,
  momentum,
  momentum_rate,
  momentum_matrix,
  kinetic_energy,
  potential_energy,
  coriolis,
  regressor,
};
constexpr int kinematics = static_cast<int>(Kinematic::regressor) + 1;

// Of one state: a result is a matrix of so many rows and columns. bodies: of the regressor.
struct KinematicShape {
  int rows, columns;
  int size() const { return rows * columns; }
};
inline std::array<KinematicShape, kinematics> kinematic_shapes(int nv, int frames, int bodies) {
  return {{{3, frames},
           {3, 3 * frames},
           {4, frames},
           {nv, 6 * frames},
           {6, frames},
           {6, frames},
           {3, 1},
           {3, 1},
           {3, 1},
           {nv, 3},
           {6, 1},
           {6, 1},
           {nv, 6},
           {1, 1},
           {1, 1},
           {nv, nv},
           {nv, 10 * bodies}}};
}

// Null: not given, or not wanted.
template <class T>
struct KinematicsCall {
  const T* q = nullptr;
  const T* qd = nullptr;
  const T* qdd = nullptr;
  Axes axes = Axes::aligned;
  std::array<T*, kinematics> out = {};

  T* operator[](Kinematic what) const { return out[static_cast<int>(what)]; }
  bool wants(std::initializer_list<Kinematic> some) const {
    return std::any_of(some.begin(), some.end(), [&](Kinematic one) { return (*this)[one]; });
  }
  // What needs qd.
  bool wants_motion() const {
    return wants({Kinematic::velocities, Kinematic::accelerations, Kinematic::center_velocity,
                  Kinematic::center_acceleration, Kinematic::momentum, Kinematic::momentum_rate,
                  Kinematic::kinetic_energy, Kinematic::coriolis, Kinematic::regressor});
  }
};

template <class T>
class KinematicsEngine {
 public:
  virtual ~KinematicsEngine() = default;
  virtual void answer(const KinematicsCall<T>& call) = 0;
  // Memory for rows of so many workers: numbered from 0, they may be called at the same time.
  virtual void reserve_workers(int count) = 0;
  virtual void answer_rows(int worker, int count, const KinematicsCall<T>& call) = 0;
};

// Of the fast path: kernels for the best instruction set there is.
template <class T>
std::unique_ptr<KinematicsEngine<T>> make_kinematics(const RobotModel& robot,
                                                     const std::vector<Frame>& frames,
                                                     const std::vector<int>& bodies);

}  // namespace kalmarm
