// A robot's kinematics on NumPy arrays, of one state or of as many as leading dimensions say.
#pragma once

#include <kalmarm/kinematics.hpp>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "workers.hpp"

namespace kalmarm::python {

class KinematicsOfRobot {
 public:
  // bodies: of the regressor, by their links; empty: all.
  KinematicsOfRobot(RobotModel model, std::vector<Frame> frames, std::vector<int> bodies);

  const RobotModel& model() const { return model_; }
  int frames() const { return static_cast<int>(frames_.size()); }
  double mass();

  // Of each of `results`, by its place in KinematicResults, an array of the leading dimensions and as many
  // numbers as a state has. qd, qdd: None where they are not given.
  nb::list compute(const std::vector<int>& results, nb::handle q, nb::handle qd, nb::handle qdd,
                   const std::string& axes, int threads);

 private:
  friend class RobotRows;  // of JAX

  RobotModel model_;
  std::vector<Frame> frames_;
  std::vector<int> bodies_;
  WorkersOfBoth<Kinematics> workers_{
      [this]<class T>() { return Kinematics<T>(model_, frames_, bodies_); }};
};

}  // namespace kalmarm::python
