// Prints what C++ makes of robots' files, for test_agreement.py: of each file nv, then M by rows and the
// acceleration where the file starts, at the velocities 0.1, 0.2, ... and torques 1, -1, 1, ...
#include <cstdio>
#include <kalmarm/dynamics.hpp>
#include <kalmarm/load.hpp>
#include <vector>

int main(int count, char** files) {
  for (int i = 1; i < count; ++i) {
    const kalmarm::LoadedRobot robot = kalmarm::load_robot(files[i]);
    const int nv = robot.model.nv();
    kalmarm::Dynamics<double> dynamics(robot.model);
    std::vector<double> qd(nv), tau(nv), a(nv), M(nv * nv);
    for (int k = 0; k < nv; ++k) qd[k] = 0.1 * (k + 1), tau[k] = k % 2 ? -1 : 1;
    dynamics.mass(robot.home, {M.data(), nv, nv});
    if (!dynamics.forward_dynamics(robot.home, qd, tau, a)) return 1;
    std::printf("%d", nv);
    for (const std::vector<double>* numbers : {&M, &a})
      for (const double x : *numbers) std::printf(" %.17g", x);
    std::printf("\n");
  }
}
