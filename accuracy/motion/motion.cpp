#include "accuracy/motion/motion.hpp"

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <limits>
#include <numbers>

#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::motion {
namespace {

constexpr double whole_steps = 1e-6;  // of a step, by which the last one may miss the end
constexpr double most_steps = 1e9;

template <class T>
Eigen::Quaternion<T> quaternion(const T* wxyz) {
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

// exp(u / 2)
template <class T>
Eigen::Quaternion<T> turn(const Vector3<T>& u) {
  const T x = u.norm() / 2;
  const T s = x > 0 ? std::sin(x) / (2 * x) : T(0.5);
  return {std::cos(x), s * u[0], s * u[1], s * u[2]};
}

// 2 log Q, of unit length, by the shorter way
template <class T>
Vector3<T> log_of(const Eigen::Quaternion<T>& Q) {
  const T sine = Q.vec().norm();
  if (sine == T(0)) return Vector3<T>::Zero();
  const T angle = 2 * std::atan2(sine, std::abs(Q.w()));
  return Vector3<T>(Q.vec() * (std::copysign(angle, Q.w()) / sine));
}

// c of (3), by its series where the quotient would cancel
template <class T>
T bernoulli(T x) {
  if (x < T(0.05)) return T(1) / 12 + x * x / 720 + x * x * x * x / 30240;
  return (1 - x / 2 / std::tan(x / 2)) / (x * x);
}

template <class T>
VectorX<T> unit_quaternions(const RobotModel& robot, VectorX<T> q) {
  for (const LinkParameters& link : robot.links)
    if (link.coordinate == Coordinate::quaternion) q.template segment<4>(link.q_index).normalize();
  return q;
}

}  // namespace

Motion make_motion(const Scene& scene, const MotionOptions& options) {
  const RobotModel robot = plain(scene.model);
  const int nv = robot.nv();
  const State start = random_states(scene, 1, options.seed).front();
  Dynamics<double> dynamics(robot);
  MatrixX<double> M(nv, nv);
  dynamics.mass(home_position(scene), M);

  Motion out{.robot = robot,
             .mujoco = mujoco_of(scene),
             .terms = {std::vector<double>(nv), std::vector<double>(nv), std::vector<double>(nv)},
             .swept = VectorX<double>::Zero(nv),
             .frequency = options.frequency,
             .q = start.q,
             .v = start.qd,
             .tau = start.tau,
             .duration = options.duration};
  boost::random::mt19937_64 random(~options.seed);  // not those of the state
  boost::random::uniform_real_distribution<double> share(-1, 1);
  for (int k = 0; k < nv; ++k) {
    if (!takes_spring(robot.links[k])) continue;
    out.terms.stiffness[k] = options.stiffness;
    out.terms.damping[k] =
        std::isnan(options.damping)
            ? 2 * options.damping_ratio * std::sqrt(options.stiffness * M(k, k))  // (5)
            : options.damping;
    out.terms.reference[k] = start.q[robot.links[k].q_index];
    out.swept[k] = options.stiffness * options.sweep * share(random);
  }
  return out;
}

template <class T>
void move(const RobotModel& robot, T h, const VectorX<T>& u, VectorX<T>& q) {
  for (int k = 0; k < robot.nv(); ++k) {
    T* const at = q.data() + robot.links[k].q_index;
    switch (robot.links[k].coordinate) {
      case Coordinate::angle:
      case Coordinate::distance:
        at[0] += h * u[k];
        break;
      case Coordinate::position:
        for (int i = 0; i < 3; ++i) at[i] += h * u[k + i];
        break;
      case Coordinate::quaternion: {
        const Vector3<T> turned = h * u.template segment<3>(k);
        const Eigen::Quaternion<T> Q = (quaternion(at) * turn(turned)).normalized();
        at[0] = Q.w(), at[1] = Q.x(), at[2] = Q.y(), at[3] = Q.z();
        break;
      }
      case Coordinate::follower:
        break;
    }
  }
}

template <class T>
void rate(const RobotModel& robot, const VectorX<T>& u, const VectorX<T>& v, VectorX<T>& out) {
  out = v;
  for (int k = 0; k < robot.nv(); ++k) {
    if (robot.links[k].coordinate != Coordinate::quaternion) continue;
    const Vector3<T> at = u.template segment<3>(k), w = v.template segment<3>(k);
    const Vector3<T> crossed = at.cross(w);
    out.template segment<3>(k) += crossed / 2 + bernoulli(at.norm()) * at.cross(crossed);  // (3)
  }
}

template <class T>
void coordinate_rate(const RobotModel& robot, const T* q, const T* v, T* out) {
  for (int k = 0; k < robot.nv(); ++k) {
    const int i = robot.links[k].q_index;
    switch (robot.links[k].coordinate) {
      case Coordinate::angle:
      case Coordinate::distance:
        out[i] = v[k];
        break;
      case Coordinate::position:
        for (int j = 0; j < 3; ++j) out[i + j] = v[k + j];
        break;
      case Coordinate::quaternion: {
        const Eigen::Quaternion<T> Q =
            quaternion(q + i) * Eigen::Quaternion<T>(T(0), v[k] / 2, v[k + 1] / 2, v[k + 2] / 2);
        out[i] = Q.w(), out[i + 1] = Q.x(), out[i + 2] = Q.y(), out[i + 3] = Q.z();
        break;
      }
      case Coordinate::follower:
        break;
    }
  }
}

VectorX<long double> difference(const RobotModel& robot, const VectorX<long double>& q2,
                                const VectorX<long double>& q1) {
  VectorX<long double> out = VectorX<long double>::Zero(robot.nv());
  for (int k = 0; k < robot.nv(); ++k) {
    const int i = robot.links[k].q_index;
    switch (robot.links[k].coordinate) {
      case Coordinate::angle:
      case Coordinate::distance:
        out[k] = q2[i] - q1[i];
        break;
      case Coordinate::position:
        out.segment<3>(k) = q2.segment<3>(i) - q1.segment<3>(i);
        break;
      case Coordinate::quaternion:
        out.segment<3>(k) = log_of<long double>(quaternion(q1.data() + i).normalized().conjugate() *
                                                quaternion(q2.data() + i).normalized());
        break;
      case Coordinate::follower:
        break;
    }
  }
  return out;
}

Errors errors(const RobotModel& robot, const VectorX<long double>& q, const VectorX<long double>& v,
              const VectorX<long double>& true_q, const VectorX<long double>& true_v) {
  return {static_cast<double>(difference(robot, q, true_q).norm() /
                              unit_quaternions(robot, true_q).norm()),
          static_cast<double>((v - true_v).norm() / true_v.norm())};
}

long steps_of(double duration, double h) {
  const double count = std::round(duration / h);
  if (!(count >= 1 && count <= most_steps && std::abs(count * h - duration) <= whole_steps * h))
    throw InputError("h = " + short_text("%g", h) +
                     " s is not a whole part of T = " + short_text("%g", duration) + " s");
  return static_cast<long>(count);
}

template void move(const RobotModel&, float, const VectorX<float>&, VectorX<float>&);
template void move(const RobotModel&, double, const VectorX<double>&, VectorX<double>&);
template void rate(const RobotModel&, const VectorX<float>&, const VectorX<float>&,
                   VectorX<float>&);
template void rate(const RobotModel&, const VectorX<double>&, const VectorX<double>&,
                   VectorX<double>&);
template void coordinate_rate(const RobotModel&, const float*, const float*, float*);
template void coordinate_rate(const RobotModel&, const double*, const double*, double*);
template void coordinate_rate(const RobotModel&, const long double*, const long double*,
                              long double*);

}  // namespace kalmarm::motion
