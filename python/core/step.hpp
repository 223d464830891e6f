// Implicit steps on NumPy arrays: the calls of kalmarm::ImplicitStep, each of one state or of as many
// as leading dimensions say, with the failures and locks of robot.hpp.
#pragma once

#include <kalmarm/implicit_step.hpp>
#include <kalmarm/step_gradients.hpp>

#include "arrays.hpp"
#include "robot.hpp"
#include "workers.hpp"

namespace kalmarm::python {

class Step {
 public:
  // Of the robot's question the tolerance and the frames that are acted on.
  Step(const Robot& robot, double h, JointTerms terms, Scheme scheme);

  double h() const { return h_; }
  Scheme scheme() const { return scheme_; }
  const RobotModel& model() const { return model_; }
  const JointTerms& terms() const { return terms_; }
  RobotModel stiff_model() const;  // whose M is M^

  // Of every state, or None: the step's own.
  struct Gains {
    nb::handle damping, stiffness, reference, armature;
  };

  // forces: None, or six numbers of every frame that is acted on, in `axes`; loads: or ten of every one that is loaded;
  // contacts: or rows of contacts, in `axes` too.
  nb::object acceleration(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
                          const Gains& gains, bool status, int threads, nb::handle forces,
                          const std::string& axes, nb::handle loads, nb::handle gravity,
                          nb::handle contacts);
  nb::object derivatives(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out, bool status,
                         nb::handle forces, const std::string& axes, nb::handle loads,
                         nb::handle gravity);

  // The products of StepGradients with w: kalmarm.StepGradients.
  nb::object vector_jacobian(nb::handle q, nb::handle qd, nb::handle tau, nb::handle w,
                             const Gains& gains, bool inertias, bool status, int threads,
                             nb::handle forces, nb::handle loads, nb::handle gravity);
  nb::object jacobian_vector(nb::handle q, nb::handle qd, nb::handle tau, nb::handle dq,
                             nb::handle dqd, nb::handle dtau, const Gains& gains,
                             const Gains& along, bool status, int threads, nb::handle forces,
                             nb::handle loads, nb::handle gravity);

  // (q, qd) after h with a. out: such a pair, or None.
  nb::tuple advance(nb::handle q, nb::handle qd, nb::handle a, nb::handle out) const;

 private:
  friend class RobotRows;  // of JAX

  RobotModel model_;
  double h_;
  JointTerms terms_;
  Scheme scheme_;
  DynamicsOptions options_;
  int forces_, loads_, contacts_;  // numbers of a state
  WorkersOfBoth<ImplicitStep> workers_{
      [this]<class T>() { return ImplicitStep<T>(model_, h_, terms_, scheme_, options_); }};
  WorkersOfBoth<StepGradients> gradients_{
      [this]<class T>() { return StepGradients<T>(model_, h_, terms_, scheme_, options_); }};
};

void bind_step(nb::module_& module);

}  // namespace kalmarm::python
