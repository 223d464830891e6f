// States in which generated code is tried before it is used.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "kalmarm/robot_model.hpp"

namespace kalmarm {

// Rows of q, qd, tau and of so many loads, the same for a robot every time. A load has up to the mass of a link.
template <class T>
struct TrialStates {
  std::vector<T> q, qd, tau, loads;

  TrialStates(const RobotModel& robot, int count, std::size_t frames) {
    double mass = 0;
    for (const LinkParameters& link : robot.links) mass += link.mass / robot.nv();
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
      for (std::size_t i = 0; i < frames; ++i) {  // balls of the radius r, at c
        const T m = T(mass) * std::abs(draw()), r = T(0.1),
                c[3] = {r * draw(), r * draw(), r * draw()};
        const T own = m * r * r, xx = m * c[0] * c[0], yy = m * c[1] * c[1], zz = m * c[2] * c[2];
        for (const T& x : {m, m * c[0], m * c[1], m * c[2], own + yy + zz, own + xx + zz,
                           own + xx + yy, -m * c[0] * c[1], -m * c[0] * c[2], -m * c[1] * c[2]})
          loads.push_back(x);
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
