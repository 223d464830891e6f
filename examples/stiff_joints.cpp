// 256 arms of seven joints that stiff position controllers hold, 100 000 N m/rad, at steps of 2 ms in
// float32: springs and dampers are taken at the end of a step. Explicitly the dampers alone would need
// steps below 2 I / b, 30 us.
#include <array>
#include <cmath>
#include <cstdio>
#include <kalmarm/implicit_step.hpp>
#include <kalmarm/model_builder.hpp>
#include <string>
#include <vector>

kalmarm::RobotModel arm(int joints) {
  kalmarm::ModelBuilder builder;
  kalmarm::BodyParameters link{.joint = kalmarm::JointType::hinge,
                               .position = {0, 0, 0.2},
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
  constexpr int joints = 7, states = 256, steps = 500;
  constexpr float dt = 0.002f;
  const std::vector<double> target = {0.3, -0.5, 0.2, 0.9, -0.1, 0.4, 0};
  const kalmarm::JointTerms controllers = {.damping = std::vector<double>(joints, 200),
                                           .stiffness = std::vector<double>(joints, 1e5),
                                           .reference = target};
  kalmarm::ImplicitStep<float> step(arm(joints), dt, controllers);

  // one state a row
  std::vector<float> q(states * joints), v(q.size()), tau(q.size()), a(q.size());
  std::vector<kalmarm::Outcome> outcomes(states);
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = std::sin(0.1f * static_cast<float>(i));

  for (int i = 0; i < steps; ++i) {
    if (const int failed = step.acceleration(q, v, tau, a, outcomes)) {
      std::printf("%d states failed\n", failed);
      return 1;
    }
    for (std::size_t k = 0; k < q.size(); ++k) {
      v[k] += dt * a[k];
      q[k] += dt * v[k];
    }
  }

  // What is left is the sag of the controllers under the arm's weight.
  double farthest = 0;
  for (std::size_t k = 0; k < q.size(); ++k)
    farthest = std::fmax(farthest, std::abs(static_cast<double>(q[k]) - target[k % joints]));
  std::printf("after %.1f s at most %.5f rad from the target\n", steps * static_cast<double>(dt),
              farthest);
  return farthest < 1e-3 ? 0 : 1;
}
