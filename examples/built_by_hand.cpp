// A double pendulum, built by hand. It swings freely for two seconds, and its energy stays what it
// was.
#include <cmath>
#include <cstdio>
#include <kalmarm/dynamics.hpp>
#include <kalmarm/model_builder.hpp>
#include <vector>

using Vector = std::vector<double>;

// Two rods of length 1 m and mass 1 kg that hang on hinges.
kalmarm::RobotModel double_pendulum() {
  kalmarm::ModelBuilder builder;
  kalmarm::BodyParameters rod{.name = "upper",
                              .joint = kalmarm::JointType::hinge,
                              .axis = {0, 1, 0},
                              .mass = 1,
                              .center_of_mass = {0, 0, -0.5},
                              .inertia = {1.0 / 12, 1.0 / 12, 0}};
  rod.parent = builder.add_body(rod);
  rod.name = "lower";
  rod.position = {0, 0, -1};
  builder.add_body(rod);
  return builder.build();
}

// The kinetic energy 1/2 qd' M qd, and the potential energy of rods that stand at angles q1 and
// q1 + q2 to the vertical.
double energy(kalmarm::Dynamics<double>& pendulum, const Vector& q, const Vector& qd) {
  Vector M(4);
  pendulum.mass(q, M);
  const double kinetic =
      0.5 * (M[0] * qd[0] * qd[0] + 2 * M[1] * qd[0] * qd[1] + M[3] * qd[1] * qd[1]);
  return kinetic - 9.81 * (1.5 * std::cos(q[0]) + 0.5 * std::cos(q[0] + q[1]));
}

int main() {
  kalmarm::Dynamics<double> pendulum(double_pendulum());
  const Vector tau(2, 0.0);
  const auto acceleration = [&](const Vector& q, const Vector& qd) {
    Vector a(2);
    if (const kalmarm::Outcome outcome = pendulum.forward_dynamics(q, qd, tau, a); !outcome)
      std::printf("forward dynamics: %s\n", to_string(outcome.status));
    return a;
  };
  const auto plus = [](Vector x, double h, const Vector& dx) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += h * dx[i];
    return x;
  };

  Vector q = {1.5, 0.5}, qd = {0, 0};
  const double start = energy(pendulum, q, qd);
  const double h = 0.001;  // [s]
  for (int step = 0; step < 2000; ++step) {
    // the Runge-Kutta method of order four
    const Vector v1 = qd, a1 = acceleration(q, v1);
    const Vector v2 = plus(qd, h / 2, a1), a2 = acceleration(plus(q, h / 2, v1), v2);
    const Vector v3 = plus(qd, h / 2, a2), a3 = acceleration(plus(q, h / 2, v2), v3);
    const Vector v4 = plus(qd, h, a3), a4 = acceleration(plus(q, h, v3), v4);
    for (int i = 0; i < 2; ++i) {
      q[i] += h / 6 * (v1[i] + 2 * v2[i] + 2 * v3[i] + v4[i]);
      qd[i] += h / 6 * (a1[i] + 2 * a2[i] + 2 * a3[i] + a4[i]);
    }
  }
  const double drift = std::abs(energy(pendulum, q, qd) - start);
  std::printf("q after 2 s: %.6f %.6f rad\n", q[0], q[1]);
  std::printf("energy: %.6f J, kept to 1e-6 J: %s\n", start, drift < 1e-6 ? "yes" : "no");
  return drift < 1e-6 ? 0 : 1;
}
