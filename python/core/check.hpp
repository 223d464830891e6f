// How wrong answers are, on NumPy arrays of float64, of one state or of as many as leading dimensions say.
#pragma once

#include <kalmarm/check.hpp>
#include <string>

#include "arrays.hpp"
#include "workers.hpp"

namespace kalmarm::python {

class CheckOfRobot {
 public:
  CheckOfRobot(RobotModel model, double tolerance, double resolution);

  // Of x as `what` (Want of its name): error, euclid, uncertainty and the number of the verdict in the last
  // dimension of one array, and outcomes. qd, tau: None where `what` has none; tau of inverse dynamics is qdd.
  nb::object answer(const std::string& what, nb::handle q, nb::handle qd, nb::handle tau,
                    nb::handle x, int threads);

 private:
  RobotModel model_;
  AnswerCheckOptions options_;
  Workers<double, AnswerCheck> workers_{[this] { return AnswerCheck(model_, options_); }};
};

}  // namespace kalmarm::python
