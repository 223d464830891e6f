// What answers for derivatives of inverse dynamics that are contracted with a vector or along a direction
// (virtual_power.hpp, tangent.hpp): plain numbers in, plain numbers out, compiled once a scalar and an instruction set.
#pragma once

#include <memory>
#include <vector>

#include "kalmarm/call.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

// What S = lambda'ID(q, qd, qdd) is derived by, and how many numbers of a state that is.
template <class T>
struct PowerAdjoints {
  T* q = nullptr;         // nv, along the axes of qd
  T* qd = nullptr;        // nv
  T* qdd = nullptr;       // nv
  T* inertias = nullptr;  // ten of every link
  T* armature = nullptr;  // nv
  T* forces = nullptr;    // six of every frame that is acted on
  T* loads = nullptr;     // ten of every frame that is loaded
  T* gravity = nullptr;   // three
};

// Null: not given or not wanted. Forces are in the axes of their frames.
template <class T>
struct GradientCall {
  bool moves = true;  // with velocities and gravity; else qd and dqd are not looked at
  const T* q = nullptr;
  const T* qd = nullptr;
  const T* qdd = nullptr;
  const T* forces = nullptr;
  const T* loads = nullptr;
  const T* gravity = nullptr;  // else the model's
  // Adjoints of sign * lambda.
  T sign = T(1);
  const T* lambda = nullptr;
  PowerAdjoints<T> by = {};
  // Or, without lambda, the tangent.
  const T* dq = nullptr;
  const T* dqd = nullptr;
  const T* dqdd = nullptr;
  T* dtau = nullptr;

  // Of the rows from i on.
  GradientCall from(std::ptrdiff_t i, const Widths& width) const {
    GradientCall rest = *this;
    const auto skip = [i](auto*& x, std::ptrdiff_t numbers) {
      if (x) x += i * numbers;
    };
    skip(rest.q, width.nq);
    for (const T** x : {&rest.qd, &rest.qdd, &rest.lambda, &rest.dq, &rest.dqd, &rest.dqdd})
      skip(*x, width.nv);
    for (T** x : {&rest.by.q, &rest.by.qd, &rest.by.qdd, &rest.by.armature, &rest.dtau})
      skip(*x, width.nv);
    skip(rest.by.inertias, numbers_of_load * width.nv);
    skip(rest.forces, width.f);
    skip(rest.by.forces, width.f);
    skip(rest.loads, width.l);
    skip(rest.by.loads, width.l);
    skip(rest.gravity, numbers_of_gravity);
    skip(rest.by.gravity, numbers_of_gravity);
    return rest;
  }
};

template <class T>
class GradientEngine {
 public:
  virtual ~GradientEngine() = default;
  // One state, in double.
  virtual void answer(const GradientCall<T>& call) = 0;
  // Memory for rows of so many workers: numbered from 0, they may be called at the same time.
  virtual void reserve_workers(int count) = 0;
  virtual void answer_rows(int worker, int count, const GradientCall<T>& call) = 0;
};

// Of the fast path: kernels for the best instruction set there is.
template <class T>
std::unique_ptr<GradientEngine<T>> make_gradients(const RobotModel& robot,
                                                  const CallFrames& frames);

}  // namespace kalmarm
