// Operational-space control at 1 kHz: the hand of an arm with three joints follows a circle in the plane, and
// the joints that this leaves free are damped.
//   tau = J^T Lambda (xdd - dJ/dt qd) + bias + N^T tau_0,  Lambda = (J M^-1 J^T)^-1,  N = 1 - M^-1 J^T Lambda J
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <kalmarm/dynamics.hpp>
#include <kalmarm/kinematics.hpp>
#include <kalmarm/model_builder.hpp>
#include <kalmarm/operational_space.hpp>

using Vector = std::array<double, 3>;  // of the joints, and of space
using Pair = std::array<double, 2>;    // along x and z
constexpr int n = 3;

struct Arm {
  kalmarm::RobotModel model;
  kalmarm::Frame hand;
};

Arm arm() {
  kalmarm::ModelBuilder builder;
  kalmarm::BodyParameters link{.name = "shoulder",
                               .joint = kalmarm::JointType::hinge,
                               .axis = {0, 1, 0},
                               .mass = 3,
                               .center_of_mass = {0.2, 0, 0},
                               .inertia = {0.002, 0.04, 0.04}};
  for (const char* name : {"elbow", "wrist"}) {
    link.parent = builder.add_body(link);
    link.name = name;
    link.position = {0.4, 0, 0};
    link.mass -= 1;
  }
  kalmarm::Frame hand = builder.frame(builder.add_body(link));
  hand.translation = {0.2, 0, 0};
  return {builder.build(), hand};
}

int main() {
  const Arm robot = arm();
  kalmarm::Kinematics<double> kinematics(robot.model, {robot.hand});
  kalmarm::Dynamics<double> dynamics(robot.model);
  kalmarm::OperationalInertia<double> inertia(2, {.clamp = 1e4}, 2);

  constexpr double stiffness = 400, damping = 40, dt = 0.001;  // [1/s^2], [1/s], [s]
  constexpr double radius = 0.15, rate = 3;                    // [m], [rad/s]
  Vector q = {-0.5, 1.2, 0.6}, qd = {0, 0, 0}, x, bias, tau, a;
  std::array<double, 6> v, drift;  // of the hand: (angular; linear)
  std::array<double, 6 * n> Jt;    // its Jacobian, transposed: column i is row i of J
  std::array<double, 2 * n> J;     // rows of x and z
  std::array<double, n * n> W, N;  // M^-1, and by columns N
  std::array<double, 4> L;         // Lambda
  Vector center = {};
  double largest = 0;
  for (int step = 0; step < 4000; ++step) {
    kinematics.compute(q, qd,
                       {.positions = x, .jacobians = Jt, .velocities = v, .accelerations = drift});
    if (step == 0) center = {x[0] - radius, 0, x[2]};
    std::copy_n(&Jt[3 * n], n, &J[0]);
    std::copy_n(&Jt[5 * n], n, &J[n]);
    dynamics.bias(q, qd, bias);
    kalmarm::Outcome outcome = dynamics.inverse_mass(q, W);
    if (outcome) outcome = inertia.compute(W, J, {.inertia = L, .projector = N}, outcome.error);

    const double t = step * dt, c = std::cos(rate * t), s = std::sin(rate * t);
    const Pair wanted = {center[0] + radius * c, center[2] + radius * s};
    const Pair speed = {-radius * rate * s, radius * rate * c};
    Pair needed = {};  // what the task needs, of which the force is Lambda times
    for (int i = 0; i < 2; ++i) {
      const int axis = 2 * i;  // x, z
      const double error = wanted[i] - x[axis];
      largest = std::max(largest, std::abs(error));
      needed[i] = -rate * rate * (wanted[i] - center[axis]) + stiffness * error +
                  damping * (speed[i] - v[3 + axis]) - drift[3 + axis];
    }
    const Pair force = {L[0] * needed[0] + L[1] * needed[1], L[2] * needed[0] + L[3] * needed[1]};
    for (int k = 0; k < n; ++k) {
      tau[k] = J[k] * force[0] + J[n + k] * force[1] + bias[k];
      for (int j = 0; j < n; ++j) tau[k] -= 2 * N[k * n + j] * qd[j];  // N^T tau_0, tau_0 = -2 qd
    }
    if (outcome) outcome = dynamics.forward_dynamics(q, qd, tau, a);
    if (!outcome) {
      std::printf("step %d: %s\n", step, to_string(outcome.status));
      return 1;
    }
    for (int k = 0; k < n; ++k) {  // semi-implicit Euler
      qd[k] += dt * a[k];
      q[k] += dt * qd[k];
    }
  }
  std::printf("a circle of %.0f mm: the hand is off by %.2f mm at most\n", 1000 * radius,
              1000 * largest);
  return largest < 0.03 ? 0 : 1;
}
