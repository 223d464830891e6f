// Constrained dynamics on NumPy arrays: the calls of kalmarm::ConstrainedDynamics, each of one state or of as many
// as leading dimensions say, with the failures and locks of robot.hpp.
#pragma once

#include <kalmarm/constrained_dynamics.hpp>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "robot.hpp"
#include "workers.hpp"

namespace kalmarm::python {

class Constrained {
 public:
  // Of the robot's question the tolerance and the frames that are acted on.
  Constrained(const Robot& robot, std::vector<Constraint> constraints, double proximal,
              int iterations);

  int rows() const { return m_; }

  // (a, forces), (qd, impulses) and (x, forces); with status and their outcomes. outside: None, or six numbers of every
  // frame that is acted on, in `axes`.
  nb::object forward_dynamics(nb::handle q, nb::handle qd, nb::handle tau, bool status, int threads,
                              nb::handle outside, const std::string& axes);
  nb::object impulse(nb::handle q, nb::handle qd, bool status, int threads);
  nb::object solve(nb::handle q, nb::handle b, bool status, int threads);

  // (e, rate, J); rate: None where qd is.
  nb::tuple evaluate(nb::handle q, nb::handle qd);

 private:
  // one(dynamics, x, forces) of one state, all(dynamics, x, forces, outcomes, threads) of rows.
  template <class One, class All>
  nb::object answer(const Inputs& in, bool status, int threads, const One& one, const All& all);

  RobotModel model_;
  std::vector<Constraint> constraints_;
  ConstrainedOptions options_;
  int m_ = 0, outside_;             // rows; numbers of forces from outside of a state
  std::vector<std::string> names_;  // of the DoF, then of the constraints
  WorkersOfBoth<ConstrainedDynamics> workers_{
      [this]<class T>() { return ConstrainedDynamics<T>(model_, constraints_, options_); }};
};

void bind_constrained(nb::module_& module);

}  // namespace kalmarm::python
