#include "accuracy/motion/mujoco_motion.hpp"

#include "accuracy/motion/acceleration.hpp"
#include "accuracy/motion/repeated.hpp"
#include "robots/scene/mujoco_step.hpp"

namespace kalmarm::motion {
namespace {

mjtIntegrator integrator_of(const std::string& name) {
  if (name == "mj_euler") return mjINT_EULER;
  if (name == "mj_implicitfast") return mjINT_IMPLICITFAST;
  if (name == "mj_discrete") return mjINT_DISCRETE;
  return mjINT_RK4;
}

// While one lives, tau(t) is among the passive forces of every mj_forward.
class TorqueOfStages {
 public:
  explicit TorqueOfStages(Torque<double>& torque) {
    current = &torque;
    mjcb_passive = [](const mjModel* m, mjData* d) {
      const VectorX<double>& tau = (*current)(d->time);
      for (int k = 0; k < m->nv; ++k) d->qfrc_passive[k] += tau[k];
    };
  }
  TorqueOfStages(const TorqueOfStages&) = delete;
  TorqueOfStages& operator=(const TorqueOfStages&) = delete;
  ~TorqueOfStages() { mjcb_passive = nullptr; }

 private:
  static inline Torque<double>* current = nullptr;
};

}  // namespace

Simulation by_mujoco(const Motion& motion, const Method& method, const Effort& effort) {
  const mjtIntegrator integrator = integrator_of(method.integrator);
  const bool stages = integrator == mjINT_RK4;
  const double h = method.step, ahead = integrator == mjINT_DISCRETE ? h : 0;
  const long count = steps_of(motion.duration, h), calls = stages ? 4 : 1;
  MujocoStep step(*motion.mujoco, h, motion.terms, integrator);
  Torque<double> torque(motion);
  const VectorX<double> none = VectorX<double>::Zero(motion.robot.nv());
  const auto run = [&] {
    step.start(motion.q, motion.v);
    for (long i = 0; i < count; ++i) {
      step.go_on(stages ? none : torque(static_cast<double>(i) * h + ahead));
      if (!std::isfinite(step.v()[0]))
        return Simulation{.status = Status::unstable, .steps = i, .calls = i * calls};
    }
    const bool finite = step.q().allFinite() && step.v().allFinite();
    return Simulation{.status = finite ? Status::ok : Status::unstable,
                      .q = step.q().cast<long double>(),
                      .v = step.v().cast<long double>(),
                      .steps = count,
                      .calls = count * calls};
  };
  if (!stages) return repeated(effort, run);
  const TorqueOfStages of_stages(torque);
  return repeated(effort, run);
}

}  // namespace kalmarm::motion
