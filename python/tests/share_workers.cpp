// Eight threads share the memory of one robot, under ThreadSanitizer: scripts/test_python compiles
// and runs this. Exits 1 where a result depends on who else calls.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <kalmarm/model_builder.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "workers.hpp"

namespace {

constexpr int links = 5, calls = 300, threads = 8, rows = 40;

kalmarm::RobotModel arm() {
  kalmarm::ModelBuilder builder;
  for (int k = 0; k < links; ++k)
    builder.add_body({.name = "link" + std::to_string(k),
                      .parent = k - 1,
                      .joint = kalmarm::JointType::hinge,
                      .axis = {0, 1, 0},
                      .position = {0, 0, 1},
                      .mass = 1,
                      .center_of_mass = {0, 0, 0.5},
                      .inertia = {1, 1, 1, 0, 0, 0}});
  return builder.build();
}

// A state of its own for every seed; one of `rows` rows, all alike, where there are many.
std::vector<double> answer(kalmarm::python::Workers<double>& workers, int seed, bool many) {
  const int count = many ? rows : 1;
  std::vector<double> x(count * links), a(count * links);
  for (int i = 0; i < count * links; ++i) x[i] = 0.1 * (seed + 1) * (i % links + 1);
  const auto worker = workers.take();
  worker->outcomes.resize(count);
  if (many) {
    const kalmarm::RowsView<const double> in(x.data(), count, links);
    const int failed = worker->dynamics.forward_dynamics(
        in, in, in, kalmarm::RowsView<double>(a.data(), count, links), worker->outcomes, 2);
    if (failed != 0) throw std::logic_error("a state without an answer");
  } else {
    const kalmarm::VectorView<const double> in(x.data(), links);
    worker->outcomes[0] = worker->dynamics.forward_dynamics(in, in, in, {a.data(), links});
  }
  return a;
}

}  // namespace

int main() {
  const kalmarm::RobotModel model = arm();
  const kalmarm::DynamicsOptions options;
  kalmarm::python::Workers<double> workers(
      [&] { return kalmarm::Dynamics<double>(model, options); });
  std::array<std::array<std::vector<double>, 2>, threads> alone;
  for (int seed = 0; seed < threads; ++seed)
    for (const bool many : {false, true}) alone[seed][many] = answer(workers, seed, many);

  std::atomic<int> wrong = 0;
  {
    std::vector<std::jthread> all;
    for (int seed = 0; seed < threads; ++seed)
      all.emplace_back([&, seed] {
        for (int call = 0; call < calls; ++call)
          for (const bool many : {false, true})
            wrong += answer(workers, seed, many) != alone[seed][many];
      });
  }
  if (wrong)
    std::fprintf(stderr, "share_workers: %d results are not what one thread gets\n", +wrong);
  return wrong != 0;
}
