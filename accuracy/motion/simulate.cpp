#include "accuracy/motion/simulate.hpp"

#include <algorithm>
#include <boost/numeric/odeint.hpp>
#include <functional>
#include <vector>

#include "accuracy/motion/acceleration.hpp"
#include "accuracy/motion/cvode.hpp"
#include "accuracy/motion/mujoco_motion.hpp"
#include "accuracy/motion/repeated.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::motion {
namespace {

namespace odeint = boost::numeric::odeint;

constexpr double first_step = 1e-6;  // of the duration, of adaptive methods
constexpr double largest_error = 1;

using Wide = long double;

template <class T>
Simulation ended(const VectorX<T>& q, const VectorX<T>& v, long steps, long calls) {
  const bool finite = q.allFinite() && v.allFinite();
  return {.status = finite ? Status::ok : Status::unstable,
          .q = q.template cast<Wide>(),
          .v = v.template cast<Wide>(),
          .steps = steps,
          .calls = calls};
}

// step(t) moves q and v on by h; false where the kernel refuses.
template <class T, class Step>
Simulation with_steps(const Motion& motion, double h, long calls_a_step, const Effort& effort,
                      VectorX<T>& q, VectorX<T>& v, Step&& step) {
  const long count = steps_of(motion.duration, h);
  return repeated(effort, [&] {
    q = motion.q.template cast<T>();
    v = motion.v.template cast<T>();
    for (long i = 0; i < count; ++i)
      if (!step(static_cast<double>(i) * h) || !std::isfinite(v[0]))
        return Simulation{.status = Status::unstable, .steps = i, .calls = i * calls_a_step};
    return ended(q, v, count, count * calls_a_step);
  });
}

// (1)
template <class T>
Simulation semi_implicit_euler(const Motion& motion, const Method& method, const Effort& effort) {
  Acceleration<T> acceleration(motion, dynamics_of(method));
  VectorX<T> q, v, a(motion.robot.nv());
  const T h = static_cast<T>(method.step);
  return with_steps(motion, method.step, 1, effort, q, v, [&](double t) {
    if (!acceleration(t, q, v, a)) return false;
    v += h * a;
    move(motion.robot, h, v, q);
    return true;
  });
}

// (2)
template <class T>
Simulation rk4(const Motion& motion, const Method& method, const Effort& effort) {
  const RobotModel& robot = motion.robot;
  Acceleration<T> acceleration(motion, dynamics_of(method));
  const double h = method.step;
  const T step = static_cast<T>(h);
  const T ahead[] = {T(0), step / 2, step / 2, step};
  const T weight[] = {step / 6, step / 3, step / 3, step / 6};
  const int nv = robot.nv();
  VectorX<T> q, v, stage_q, stage_v, u(nv), rate_u(nv), a(nv), sum_u(nv), sum_v(nv);
  return with_steps(motion, h, 4, effort, q, v, [&](double t) {
    sum_u.setZero();
    sum_v.setZero();
    stage_q = q;
    stage_v = v;
    for (int i = 0; i < 4; ++i) {
      if (i == 0) {
        rate_u = v;
      } else {
        u = ahead[i] * rate_u;
        stage_q = q;
        move(robot, T(1), u, stage_q);
        stage_v = v + ahead[i] * a;
        rate(robot, u, stage_v, rate_u);
      }
      if (!acceleration(t + static_cast<double>(ahead[i]), stage_q, stage_v, a)) return false;
      sum_u += weight[i] * rate_u;
      sum_v += weight[i] * a;
    }
    move(robot, T(1), sum_u, q);
    v += sum_v;
    return true;
  });
}

// (3), (4)
template <class T>
Simulation implicit(const Motion& motion, const Method& method, const Effort& effort,
                    Scheme scheme) {
  const double h = method.step, ahead = scheme == Scheme::springs_at_end ? h : 0;
  ImplicitStep<T> step(motion.robot, h, motion.terms, scheme, dynamics_of(method));
  Torque<T> torque(motion);
  VectorX<T> q, v, a(motion.robot.nv());
  return with_steps(motion, h, 1, effort, q, v, [&](double t) {
    return static_cast<bool>(step.step(q, v, torque(t + ahead), a));
  });
}

template <class T>
Simulation dopri5(const Motion& motion, const Method& method, const Effort& effort) {
  using State = std::vector<T>;
  const int nq = motion.robot.nq, nv = motion.robot.nv();
  StateRate<T> rate(motion, dynamics_of(method), effort.cap);
  const auto f = [&](const State& x, State& derivative, T t) {
    rate(t, x.data(), derivative.data());
  };
  return repeated(effort, [&] {
    rate.begin();
    auto stepper = odeint::make_controlled<odeint::runge_kutta_dopri5<State, T, State, T>>(
        static_cast<T>(method.step), static_cast<T>(method.step));
    State x(nq + nv);
    Eigen::Map<VectorX<T>>(x.data(), nq) = motion.q.template cast<T>();
    Eigen::Map<VectorX<T>>(x.data() + nq, nv) = motion.v.template cast<T>();
    const T end = static_cast<T>(motion.duration);
    T t = 0, h = static_cast<T>(first_step) * end;
    long steps = 0;
    for (bool last = false; !last;) {
      const T before = t;
      T tried = std::min(h, end - t);
      const bool to_the_end = tried == end - t;
      const bool accepted = stepper.try_step(f, x, t, tried) == odeint::success;
      h = tried;
      const bool stuck = accepted && !to_the_end && t == before;  // h is nothing beside t
      if (rate.stopped() || stuck || !(h > T(0)))
        return Simulation{.status = rate.capped() || stuck ? Status::given_up : Status::unstable,
                          .steps = steps,
                          .calls = rate.calls()};
      steps += accepted;
      last = accepted && to_the_end;
    }
    const Eigen::Map<const VectorX<T>> q(x.data(), nq), v(x.data() + nq, nv);
    return ended(VectorX<T>(q), VectorX<T>(v), steps, rate.calls());
  });
}

template <class T>
Simulation by_kalmarm(const Motion& motion, const Method& method, const Effort& effort) {
  if (method.integrator == "semi_implicit_euler")
    return semi_implicit_euler<T>(motion, method, effort);
  if (method.integrator == "rk4") return rk4<T>(motion, method, effort);
  if (method.integrator == "springs_at_start")
    return implicit<T>(motion, method, effort, Scheme::springs_at_start);
  if (method.integrator == "springs_at_end")
    return implicit<T>(motion, method, effort, Scheme::springs_at_end);
  return dopri5<T>(motion, method, effort);
}

}  // namespace

const char* to_string(Status status) {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::unstable:
      return "unstable";
    case Status::given_up:
      return "given_up";
  }
  return "?";
}

const std::vector<Integrator>& integrators() {
  static const std::vector<Integrator> all = [] {
    std::vector<Integrator> out = {{"semi_implicit_euler", false, false, true},
                                   {"rk4", false, false, true},
                                   {"springs_at_start", false, false, true},
                                   {"springs_at_end", false, false, true},
                                   {"mj_euler", false, true, false},
                                   {"mj_implicitfast", false, true, false},
                                   {"mj_discrete", false, true, false},
                                   {"mj_rk4", false, true, false},
                                   {"dopri5", true, false, true}};
    if (has_cvode()) out.push_back({"cvode_bdf", true, false, false});
    return out;
  }();
  return all;
}

Simulation simulate(const Motion& motion, const Method& method, const Effort& effort) {
  const auto known = std::ranges::find(integrators(), method.integrator, &Integrator::name);
  if (known == integrators().end())
    throw InputError("integrator '" + method.integrator + "' is not in this build");
  if (method.float32 && !known->float32)
    throw InputError("integrator '" + method.integrator + "' has no float32");
  if (known->of_mujoco && !motion.mujoco)
    throw InputError("integrator '" + method.integrator + "' of a robot that is not in MuJoCo");
  if (known->of_mujoco) return by_mujoco(motion, method, effort);
  if (known->name == "cvode_bdf") return by_cvode(motion, method, effort);
  return method.float32 ? by_kalmarm<float>(motion, method, effort)
                        : by_kalmarm<double>(motion, method, effort);
}

Status judged(Status status, const Errors& errors) {
  const bool near = errors.q <= largest_error && errors.v <= largest_error;
  return status == Status::ok && !near ? Status::unstable : status;
}

}  // namespace kalmarm::motion
