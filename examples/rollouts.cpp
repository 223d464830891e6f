// 1024 states of an arm of seven joints rolled out at once, on every core: a batch is one call.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <kalmarm/dynamics.hpp>
#include <kalmarm/model_builder.hpp>
#include <string>
#include <thread>
#include <vector>

kalmarm::RobotModel arm(int joints) {
  kalmarm::ModelBuilder builder;
  kalmarm::BodyParameters link{.joint = kalmarm::JointType::hinge,
                               .position = {0, 0, 0.2},
                               .armature = 0.1,
                               .mass = 2,
                               .center_of_mass = {0, 0.01, 0.1},
                               .inertia = {0.01, 0.01, 0.003}};
  for (int k = 0; k < joints; ++k) {
    link.name = "joint" + std::to_string(k);
    link.axis = k % 2 == 0 ? std::array<double, 3>{0, 0, 1} : std::array<double, 3>{0, 1, 0};
    link.parent = builder.add_body(link);
  }
  return builder.build();
}

int main() {
  constexpr int joints = 7, states = 1024, steps = 200;
  constexpr double dt = 0.002;
  const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  kalmarm::Dynamics<double> robot(arm(joints),
                                  {.question = {.want = {kalmarm::Want::acceleration}}});

  // one state a row
  std::vector<double> q(states * joints), qd(q.size()), tau(q.size()), a(q.size());
  std::vector<kalmarm::Outcome> outcomes(states);
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = std::sin(0.1 * static_cast<double>(i));

  const auto start = std::chrono::steady_clock::now();
  for (int step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < q.size(); ++i) tau[i] = -20 * q[i] - 5 * qd[i];
    if (const int failed = robot.forward_dynamics(q, qd, tau, a, outcomes, threads)) {
      std::printf("%d states failed\n", failed);
      return 1;
    }
    for (std::size_t i = 0; i < q.size(); ++i) {
      qd[i] += dt * a[i];
      q[i] += dt * qd[i];
    }
  }
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;

  double squares = 0;
  for (const double x : q) squares += x * x;
  std::printf("RMS of q after %.1f s: %.6f rad\n", steps * dt,
              std::sqrt(squares / static_cast<double>(q.size())));
  std::printf("%.3g states per second (%d threads, %s)\n", states * steps / elapsed.count(),
              threads, kalmarm::instruction_set());
  return 0;
}
