// Motion that excites a robot's inertial parameters: finite Fourier series in every coordinate,
//
//   x(t) = x0 + sum over l of a_l sin(l w t) / (l w) + b_l cos(l w t) / (l w)^2
// scaled to stay within the joint's range and a largest speed, chosen for the condition number of
// the regressor (its columns scaled to unit length, the ones that no motion excites left out).
// Orientations are the series of four numbers u around 1, q = u / |u| (quaternion_rates.hpp).
#pragma once

#include <cstdint>

#include "accuracy/fits/samples.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

struct ExcitationOptions {
  int count = 2000;    // samples, evenly over one period
  double period = 10;  // [s]
  int harmonics = 5;
  double speed = 2;  // largest joint speed [rad/s]; of slides half of it [m/s]
  std::uint64_t seed = 1;
  int candidates = 100;  // tried; 1: the first one as it is drawn
};

struct Excitation {
  Samples samples;   // torques zero
  double condition;  // of the regressor
};

Excitation excite(const Scene& scene, const ExcitationOptions& options);

}  // namespace kalmarm
