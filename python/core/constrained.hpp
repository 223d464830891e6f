// Constrained dynamics on NumPy arrays: the calls of kalmarm::ConstrainedDynamics, each of one state or of as many
// as leading dimensions say, with the failures and locks of robot.hpp.
#pragma once

#include <kalmarm/constrained_dynamics.hpp>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "workers.hpp"

namespace kalmarm::python {

class Constrained {
 public:
  Constrained(RobotModel model, std::vector<Constraint> constraints, ConstrainedOptions options);

  int rows() const { return m_; }

  // (a, forces), (qd, impulses) and (x, forces); with status and their outcomes.
  nb::object forward_dynamics(nb::handle q, nb::handle qd, nb::handle tau, bool status,
                              int threads);
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
  int m_ = 0;
  std::vector<std::string> names_;  // of the DoF, then of the constraints
  WorkersOfBoth<ConstrainedDynamics> workers_{
      [this]<class T>() { return ConstrainedDynamics<T>(model_, constraints_, options_); }};
};

void bind_constrained(nb::module_& module);

}  // namespace kalmarm::python
