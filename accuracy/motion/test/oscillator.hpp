// Motions whose ends are known in closed form.
#pragma once

#include <cmath>
#include <numbers>

#include "accuracy/motion/motion.hpp"
#include "kalmarm/model_builder.hpp"

namespace kalmarm::motion {

// A mass on a spring and a damper, under a constant force and a target that moves, without gravity.
struct Oscillator {
  double m = 2, k = 800, b = 0, q0 = 0.25, force = 3, swept = 0, frequency = 1.2;
  double q = 0.6, v = -1.5, duration = 0.5;

  Motion motion() const {
    ModelBuilder builder;
    builder.set_gravity({0, 0, 0});
    builder.add_body({.name = "x", .joint = JointType::slide, .mass = m});
    return {.robot = builder.build(),
            .mujoco = nullptr,
            .terms = {{b}, {k}, {q0}},
            .swept = VectorX<double>::Constant(1, swept),
            .frequency = frequency,
            .q = VectorX<double>::Constant(1, q),
            .v = VectorX<double>::Constant(1, v),
            .tau = VectorX<double>::Constant(1, force),
            .duration = duration};
  }

  // Undamped, x = q - q0 - force / k:  x'' = -w^2 x + (swept / m) sin(W t), whose solution is
  //   A sin(W t) + C cos(w t) + S sin(w t),  A = (swept / m) / (w^2 - W^2)
  struct End {
    long double q, v;
  };
  End end() const {
    const long double w = std::sqrt(static_cast<long double>(k) / m);
    const long double W = 2 * std::numbers::pi_v<long double> * static_cast<long double>(frequency);
    const long double A = swept / static_cast<long double>(m) / (w * w - W * W);
    const long double rest = q0 + force / static_cast<long double>(k), t = duration;
    const long double C = q - rest, S = (v - A * W) / w;
    return {rest + A * std::sin(W * t) + C * std::cos(w * t) + S * std::sin(w * t),
            A * W * std::cos(W * t) - C * w * std::sin(w * t) + S * w * std::cos(w * t)};
  }
};

// A free body that turns, whose end is known by its own truth alone: no springs.
inline Motion tumbling(double duration) {
  ModelBuilder builder;
  builder.set_gravity({0, 0, 0});
  builder.add_body({.name = "brick",
                    .joint = JointType::free,
                    .mass = 2,
                    .center_of_mass = {0.1, -0.2, 0.05},
                    .inertia = {0.3, 0.5, 0.7, 0, 0, 0}});
  Motion out{.robot = builder.build(),
             .mujoco = nullptr,
             .terms = {},
             .swept = VectorX<double>::Zero(6),
             .frequency = 1,
             .q = VectorX<double>::Zero(7),
             .v = VectorX<double>(6),
             .tau = VectorX<double>::Zero(6),
             .duration = duration};
  out.terms = {std::vector<double>(6), std::vector<double>(6), std::vector<double>(6)};
  out.q[3] = 1;
  out.v << 0.3, -0.4, 0.2, 2.5, -1.5, 3;
  return out;
}

}  // namespace kalmarm::motion
