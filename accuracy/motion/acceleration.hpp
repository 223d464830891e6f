// a(q, v, t) of a motion (motion.hpp) by the fast path, and its torque.
#pragma once

#include <cmath>
#include <numbers>

#include "accuracy/motion/motion.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm::motion {

// tau(t), in T.
template <class T>
class Torque {
 public:
  explicit Torque(const Motion& motion)
      : constant_(motion.tau.template cast<T>()),
        swept_(motion.swept.template cast<T>()),
        w_(2 * std::numbers::pi * motion.frequency),
        now_(constant_) {}

  const VectorX<T>& operator()(double t) {
    now_ = constant_ + static_cast<T>(std::sin(w_ * t)) * swept_;
    return now_;
  }

 private:
  VectorX<T> constant_, swept_;
  double w_;
  VectorX<T> now_;
};

// A step of h = 0 has the acceleration of forward dynamics under springs and dampers.
template <class T>
class Acceleration {
 public:
  Acceleration(const Motion& motion, const DynamicsOptions& dynamics)
      : torque_(motion), step_(motion.robot, 0, motion.terms, Scheme::springs_at_start, dynamics) {}

  bool operator()(double t, VectorView<const T> q, VectorView<const T> v, VectorView<T> a) {
    ++calls_;
    return static_cast<bool>(step_.acceleration(q, v, torque_(t), a));
  }

  long calls() const { return calls_; }
  void begin() { calls_ = 0; }

 private:
  Torque<T> torque_;
  ImplicitStep<T> step_;
  long calls_ = 0;
};

// x' of x = (q; v), side by side, for methods that know no manifold. Once it has stopped, at `cap`
// calls or where the kernel refuses, x' is not to be used.
template <class T>
class StateRate {
 public:
  StateRate(const Motion& motion, const DynamicsOptions& dynamics, long cap)
      : robot_(motion.robot), acceleration_(motion, dynamics), cap_(cap) {}

  bool operator()(double t, const T* x, T* out) {
    const int nq = robot_.nq, nv = robot_.nv();
    capped_ = capped_ || acceleration_.calls() == cap_;
    if (capped_ || refused_) return false;
    coordinate_rate(robot_, x, x + nq, out);
    refused_ = !acceleration_(t, {x, nq}, {x + nq, nv}, {out + nq, nv});
    return !refused_;
  }

  bool stopped() const { return capped_ || refused_; }
  bool capped() const { return capped_; }
  long calls() const { return acceleration_.calls(); }
  void begin() {
    acceleration_.begin();
    capped_ = refused_ = false;
  }

 private:
  const RobotModel& robot_;
  Acceleration<T> acceleration_;
  long cap_;
  bool capped_ = false, refused_ = false;
};

}  // namespace kalmarm::motion
