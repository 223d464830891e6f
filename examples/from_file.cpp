// A robot from an MJCF or URDF file: its joints, the torques that hold it where the file starts,
// and, for a site or body, the mass that a force there meets along each axis.
//
//   from_file ROBOT.xml [SITE]
#include <cstdio>
#include <exception>
#include <kalmarm/dynamics.hpp>
#include <kalmarm/load.hpp>
#include <vector>

int main(int argc, char** argv) try {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: from_file ROBOT.xml [SITE]\n");
    return 2;
  }
  const kalmarm::LoadedRobot robot = kalmarm::load_robot(argv[1]);
  kalmarm::Question question;
  if (argc == 3) question.frames = {robot.frame(argv[2])};
  kalmarm::Dynamics<double> dynamics(robot.model, {.question = question});

  std::vector<double> tau(dynamics.nv()), d(dynamics.nv());
  dynamics.gravity(robot.home, tau);
  if (const kalmarm::Outcome outcome = dynamics.diagonal(robot.home, d); !outcome) {
    std::fprintf(stderr, "from_file: M^-1 is %s\n", to_string(outcome.status));
    return 1;
  }
  std::printf("%s: %d degrees of freedom\n", robot.name.c_str(), dynamics.nv());
  for (int k = 0; k < dynamics.nv(); ++k)
    std::printf("%-28s gravity %11.6f  diagonal of M^-1 %11.6f\n", robot.model.names[k].c_str(),
                tau[k], d[k]);
  if (argc == 3) {
    std::vector<double> X(6 * 6);  // J M^-1 J', (angular; linear)
    if (const kalmarm::Outcome outcome = dynamics.operational(robot.home, X); !outcome) return 1;
    for (int i = 3; i < 6; ++i)
      std::printf("a force along %c of %s meets %.6f kg\n", "xyz"[i - 3], argv[2], 1 / X[7 * i]);
  }
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "from_file: error: %s\n", e.what());
  return 2;
}
