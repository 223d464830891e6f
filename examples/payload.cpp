// A Panda arm swings 2 kg in its hand, under computed torque and under operational-space control. Each controller
// knows nothing of the payload, its weight as a force from outside, or all of it as a body.
//   computed torque:   tau = M qdd + bias - J^T f,  qdd = qdd_path + feedback of the joints
//   operational space: tau = M qdd + bias - J^T f + J^T Lambda (xdd - J qdd - dJ/dt qd),  qdd for the posture alone
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <kalmarm/dynamics.hpp>
#include <kalmarm/kinematics.hpp>
#include <kalmarm/model_builder.hpp>
#include <kalmarm/operational_space.hpp>
#include <numbers>

constexpr int n = 7;
using Vector = std::array<double, n>;
using Spatial = std::array<double, 6>;  // (angular; linear)

struct Arm {
  kalmarm::RobotModel model;
  kalmarm::Frame load;
};

// The numbers of robots/models/panda, with the hand and its fingers in one and a ball of `mass` in it.
Arm panda(double mass) {
  // Of a joint: position, quarter turn about x, mass, centre of mass, moments xx, yy, zz, xy, xz, yz.
  constexpr double links[n][14] = {
      {0, 0, 0.333, 0, 4.970684, 0.003875, 0.002081, -0.04762, 0.70337, 0.70661, 0.009117,
       -0.000139, 0.006772, 0.019169},
      {0, 0, 0, -1, 0.646926, -0.003141, -0.02872, 0.003495, 0.007962, 0.02811, 0.025995, -0.003925,
       0.010254, 0.000704},
      {0, -0.316, 0, 1, 3.228604, 0.027518, 0.039252, -0.066502, 0.037242, 0.036155, 0.01083,
       -0.004761, -0.011396, -0.012805},
      {0.0825, 0, 0, 1, 3.587895, -0.05317, 0.104419, 0.027454, 0.025853, 0.019552, 0.028323,
       0.007796, -0.001332, 0.008641},
      {-0.0825, 0.384, 0, -1, 1.225946, -0.011953, 0.041065, -0.038437, 0.035549, 0.029474,
       0.008627, -0.002117, -0.004037, 0.000229},
      {0, 0, 0, 1, 1.666555, 0.060149, -0.014117, -0.010517, 0.001964, 0.004354, 0.005433, 0.000109,
       -0.001158, 0.000341},
      {0.088, 0, 0, 1, 0.735522, 0.010517, -0.004252, 0.061597, 0.012516, 0.010027, 0.004815,
       -0.000428, -0.001196, -0.000741},
  };
  kalmarm::ModelBuilder builder;
  kalmarm::BodyParameters link{.joint = kalmarm::JointType::hinge, .armature = 0.1};
  for (const auto& l : links) {
    link.position = {l[0], l[1], l[2]};
    link.rotation = {1, l[3], 0, 0};
    link.mass = l[4];
    link.center_of_mass = {l[5], l[6], l[7]};
    std::copy_n(&l[8], 6, link.inertia.begin());
    link.parent = builder.add_body(link);
  }
  kalmarm::BodyParameters hand{.parent = link.parent,
                               .position = {0, 0, 0.107},
                               .mass = 0.76,
                               .center_of_mass = {0, 0, 0.03},
                               .inertia = {0.001, 0.0025, 0.0017}};
  kalmarm::BodyParameters ball{
      .parent = builder.add_body(hand), .position = {0, 0, 0.15}, .mass = mass};
  std::fill_n(ball.inertia.begin(), 3, 0.001 * mass);  // xx, yy, zz
  const int load = builder.add_body(ball);
  return {builder.build(), builder.frame(load)};
}

// The largest distance of the load from its path [m], under a controller that knows an arm and a force on its load.
double track(const Arm& arm, const Arm& known, const Spatial& force, bool operational) {
  kalmarm::Kinematics<double> load(arm.model, {arm.load});
  kalmarm::Dynamics<double> truth(arm.model);
  kalmarm::Dynamics<double> dynamics(known.model, {.question = {.acted_on = {known.load}}});
  kalmarm::OperationalInertia<double> inertia(3);

  constexpr double dt = 0.001, rate = std::numbers::pi;   // [s], [rad/s]
  constexpr double stiffness = 400, damping = 40;         // [1/s^2], [1/s]
  constexpr Vector pose = {0, -0.3, 0, -2.2, 0, 2, 0.8};  // [rad]
  constexpr Vector reach = {0.3, 0.2, -0.3, 0.3, 0.2, 0.3, 0.4};
  Vector q = pose, qd = {}, q_path, qd_path, qdd_path, qdd, tau, a;
  std::array<double, 3> x, x_path, task;
  std::array<double, 9> L;       // Lambda
  std::array<double, n * n> W;   // M^-1
  std::array<double, 6 * n> Jt;  // column i is row i of J
  Spatial v, v_path, acceleration, a_path;
  double largest = 0;
  for (int step = 0; step < 4000; ++step) {
    const double s = std::sin(rate * step * dt), c = std::cos(rate * step * dt);
    for (int k = 0; k < n; ++k) {
      q_path[k] = pose[k] + reach[k] * (1 - c);
      qd_path[k] = reach[k] * rate * s;
      qdd_path[k] = reach[k] * rate * rate * c;
      qdd[k] = operational
                   ? 10 * (pose[k] - q[k]) - 6 * qd[k]
                   : qdd_path[k] + stiffness * (q_path[k] - q[k]) + damping * (qd_path[k] - qd[k]);
    }
    load.compute(q_path, qd_path, qdd_path,
                 {.positions = x_path, .velocities = v_path, .accelerations = a_path});
    load.compute(q, qd, qdd,
                 {.positions = x, .jacobians = Jt, .velocities = v, .accelerations = acceleration});
    largest = std::max(largest, std::hypot(x_path[0] - x[0], x_path[1] - x[1], x_path[2] - x[2]));
    dynamics.inverse_dynamics(q, qd, qdd, tau, {.on = force});
    kalmarm::Outcome outcome;
    if (operational) {  // of the linear rows
      const double* J = &Jt[3 * n];
      outcome = dynamics.inverse_mass(q, W);
      if (outcome) outcome = inertia.compute(W, {J, n, 3}, {.inertia = L}, outcome.error);
      for (int i = 0; i < 3; ++i)
        task[i] = a_path[3 + i] - acceleration[3 + i] + stiffness * (x_path[i] - x[i]) +
                  damping * (v_path[3 + i] - v[3 + i]);
      for (int i = 0; i < 3; ++i) {
        const double push = L[3 * i] * task[0] + L[3 * i + 1] * task[1] + L[3 * i + 2] * task[2];
        for (int k = 0; k < n; ++k) tau[k] += J[i * n + k] * push;
      }
    }
    if (outcome) outcome = truth.forward_dynamics(q, qd, tau, a);
    if (!outcome) {
      std::printf("step %d: %s\n", step, to_string(outcome.status));
      std::exit(1);
    }
    for (int k = 0; k < n; ++k) {  // semi-implicit Euler
      qd[k] += dt * a[k];
      q[k] += dt * qd[k];
    }
  }
  return largest;
}

int main() {
  constexpr double payload = 2;  // [kg]
  const Arm arm = panda(payload), empty = panda(0);
  const Spatial weight = {0, 0, 0, 0, 0, -9.81 * payload};
  bool good = true;
  for (const bool operational : {false, true}) {
    const double nothing = track(arm, empty, {}, operational);
    const double force = track(arm, empty, weight, operational);
    const double body = track(arm, arm, {}, operational);
    std::printf("%s: off by %.1f mm, with the weight %.1f mm, with the body %.2f mm\n",
                operational ? "operational space" : "computed torque", 1000 * nothing, 1000 * force,
                1000 * body);
    good = good && body < 0.001 && nothing > 0.01;
  }
  return good ? 0 : 1;
}
