// States in which generated code is tried before it is used.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "kalmarm/robot_model.hpp"

namespace kalmarm {

// Rows of q, qd and tau, the same for a robot every time.
template <class T>
struct TrialStates {
  std::vector<T> q, qd, tau;

  TrialStates(const RobotModel& robot, int count) {
    std::mt19937_64 random(1);
    const auto draw = [&random] { return T(2 * (double(random() >> 11) * 0x1p-53) - 1); };
    for (int i = 0; i < count; ++i) {
      for (const LinkParameters& link : robot.links) {
        const std::size_t first = q.size();
        for (int j = 0; j < q_entries(link.coordinate); ++j)
          q.push_back(link.coordinate == Coordinate::angle ? 3 * draw() : draw());
        if (link.coordinate == Coordinate::quaternion) normalize(&q[first]);
      }
      for (int k = 0; k < robot.nv(); ++k) {
        qd.push_back(draw());
        tau.push_back(draw());
      }
    }
  }

 private:
  static void normalize(T* x) {
    T squares = 0;
    for (int i = 0; i < 4; ++i) squares += x[i] * x[i];
    for (int i = 0; i < 4; ++i) x[i] /= std::sqrt(squares);
  }
};

}  // namespace kalmarm
