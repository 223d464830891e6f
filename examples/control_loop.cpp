// Computed-torque control of a two-link arm at 1 kHz: inverse dynamics turns the acceleration that
// is wanted into torques, and forward dynamics plays the arm, which carries a load that the
// controller does not know of.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <kalmarm/dynamics.hpp>
#include <kalmarm/model_builder.hpp>

using Vector = std::array<double, 2>;

kalmarm::RobotModel arm(double load) {
  kalmarm::ModelBuilder builder;
  kalmarm::BodyParameters link{.name = "shoulder",
                               .joint = kalmarm::JointType::hinge,
                               .axis = {0, 1, 0},
                               .armature = 0.05,
                               .mass = 3,
                               .center_of_mass = {0.25, 0, 0},
                               .inertia = {0.002, 0.06, 0.06}};
  link.parent = builder.add_body(link);
  link.name = "elbow";
  link.position = {0.5, 0, 0};
  link.mass = 2;
  const int forearm = builder.add_body(link);
  builder.add_body({.name = "load", .parent = forearm, .position = {0.5, 0, 0}, .mass = load});
  return builder.build();
}

int main() {
  using kalmarm::Want;
  kalmarm::Dynamics<double> known(arm(0), {.question = {.want = {Want::inverse_dynamics}}});
  kalmarm::Dynamics<double> real(arm(0.2), {.question = {.want = {Want::acceleration}}});

  constexpr double stiffness = 400, damping = 40;  // [1/s^2], [1/s]: critically damped at 20 rad/s
  constexpr double dt = 0.001;
  Vector q = {0, 0}, qd = {0, 0}, tau, a;
  double squares = 0, largest = 0;
  constexpr int steps = 4000;
  for (int step = 0; step < steps; ++step) {
    const double t = step * dt;
    Vector wanted;
    for (int i = 0; i < 2; ++i) {
      // x(t) = 1/2 (1 - cos(w t)), from rest
      const double w = i + 1.0;
      const double x = 0.5 * (1 - std::cos(w * t)), xd = 0.5 * w * std::sin(w * t),
                   xdd = 0.5 * w * w * std::cos(w * t);
      wanted[i] = xdd + damping * (xd - qd[i]) + stiffness * (x - q[i]);
      squares += (x - q[i]) * (x - q[i]);
      largest = std::max(largest, std::abs(x - q[i]));
    }
    known.inverse_dynamics(q, qd, wanted, tau);
    if (const kalmarm::Outcome outcome = real.forward_dynamics(q, qd, tau, a); !outcome) {
      std::printf("forward dynamics: %s\n", to_string(outcome.status));
      return 1;
    }
    for (int i = 0; i < 2; ++i) {  // semi-implicit Euler
      qd[i] += dt * a[i];
      q[i] += dt * qd[i];
    }
  }
  std::printf("tracking error with a load of 0.2 kg unknown: RMS %.6f rad, largest %.6f rad\n",
              std::sqrt(squares / (2 * steps)), largest);
  return largest < 0.05 ? 0 : 1;
}
