// A robot's motion under springs, dampers and a target that moves, and the error of a simulation of it.
//
//   M(q) v' + bias(q, v) = tau(t) - B v - K (q - q0)                                          (1)
//   tau(t) = tau0 + s(t) K A,  s(t) = sin(2 pi f t)
// is a position controller with gains K and B whose target, q0 + s(t) A, moves: K, B and A are diagonal,
// tau0 is constant. The target moves since a controlled robot comes to rest at a target that stands,
// and there every stable method is right, whatever its step.
//
// Coordinates of a joint give q' from v: equal for hinges, slides and positions, and with v = w the
// angular velocity in the body's axes, for a quaternion Q
//   Q' = Q (0, w) / 2,   Q (+) u = Q exp(u / 2),   Q2 (-) Q1 = 2 log(Q1^-1 Q2)                (2)
// of which (+) and (-) are + and - for other coordinates. The motion through Q (+) u(t) has
//   u' = w + u x w / 2 + c u x (u x w),   c = (1 - (x / 2) cot(x / 2)) / x^2,  x = |u|        (3)
//
// Errors of q and v at the end, T, against the true q* and v*, quaternions of unit length:
//   e_q = |q (-) q*| / |q*|,   e_v = |v - v*| / |v*|                                          (4)
// with |q*| over all nq entries. In precision u the former cannot be expected below about u.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/model.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm::motion {

struct Motion {
  RobotModel robot;
  std::shared_ptr<const MujocoModel> mujoco;  // null: mj_step does not take part
  JointTerms terms;                           // B, K, q0, nv entries each
  VectorX<double> swept;                      // K A, nv
  double frequency = 0;                       // f [Hz]
  VectorX<double> q, v, tau;                  // at t = 0, and tau0
  double duration = 0;                        // T [s]
};

struct MotionOptions {
  double duration = 0.5;     // T [s]
  double stiffness = 1e5;    // of every hinge and slide [N m/rad or N/m]
  double damping_ratio = 1;  // zeta, where `damping` is NaN
  double damping = NAN;      // of every hinge and slide [N m s/rad or N s/m]
  double sweep = 0.2;        // |A(k)| is at most that [rad or m]
  double frequency = 1.2;    // f [Hz]; T = 0.5 s is then no special point of the sine
  std::uint64_t seed = 1;
};

// From a random state (random_states), which is where the target starts: q0 = q(0), v and tau0 N(0,1),
// A(k) uniform in [-sweep, sweep]. By its ratio a joint's damping is
//   b(k) = 2 zeta sqrt(k(k) M(k,k))                                                           (5)
// with M(k,k), armature included, of the robot's home position: what the joint moves where the others
// are locked, as MuJoCo's dampratio has it. A fingertip's b is then as small as its inertia; one b for
// all joints would brake it until it creeps. Joints without springs have no dampers.
Motion make_motion(const Scene& scene, const MotionOptions& options);

// q <- q (+) h u, of nv numbers u.
template <class T>
void move(const RobotModel& robot, T h, const VectorX<T>& u, VectorX<T>& q);

// (3), for every quaternion: u' of u and v.
template <class T>
void rate(const RobotModel& robot, const VectorX<T>& u, const VectorX<T>& v, VectorX<T>& out);

// q' of q and v by (2); q (nq), v and q' are numbers side by side. Of quaternions of any length.
template <class T>
void coordinate_rate(const RobotModel& robot, const T* q, const T* v, T* out);

// q2 (-) q1, nv numbers.
VectorX<long double> difference(const RobotModel& robot, const VectorX<long double>& q2,
                                const VectorX<long double>& q1);

struct Errors {
  double q = 0, v = 0;
};

// (4)
Errors errors(const RobotModel& robot, const VectorX<long double>& q, const VectorX<long double>& v,
              const VectorX<long double>& true_q, const VectorX<long double>& true_v);

// Number of steps of h in the duration. Throws InputError where h does not divide it.
long steps_of(double duration, double h);

}  // namespace kalmarm::motion
