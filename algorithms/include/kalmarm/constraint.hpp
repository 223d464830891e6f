// What holds frames or joints of a robot together: plain numbers, of which ConstrainedDynamics
// (constrained_dynamics.hpp) makes rows, and which the loader of robot files gives.
//
//   kind       rows   e
//   point      3      p1 - p2                                  the frames' origins, in the base's axes           [m]
//   pose       6      2 s v of R2' R1, then p1 - p2            (w, v): its quaternion; s: `turning`      [rad times s; m]
//   coupling   1      l1(q) - sum over i of c(i) (l2(q) - l0)^i     l1 = J1 q, l2 = J2 q: lengths of hinges and slides
//
// Near e = 0 a pose's first three rows are the vector of the turn from frame 2 to frame 1, in the axes of frame 2. At half a
// turn they are flat, and the constraint is singular.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "kalmarm/robot_model.hpp"

namespace kalmarm {

// The share d of the constraint's force that acts at the distance r = |e|: from `least` at 0 to `most` at `width`, with x = r / width,
//   d = least + y (most - least),  y = x^p / m^(p-1) up to the midpoint m, from there 1 - (1 - x)^p / (1 - m)^(p-1)
// which is solimp of MuJoCo. Shares lie between 0 and 1, 1 included; r above the width counts as it.
struct Impedance {
  double least = 1, most = 1;
  double width = 0;  // [m, rad or what e has]
  double midpoint = 0.5, power = 2;
};

struct Constraint {
  enum class Kind { point, pose, coupling };

  std::string name = {};
  Kind kind = Kind::point;

  // --- of a point and a pose
  Frame first = {}, second = {};  // link -1: on the base
  double turning = 1;             // s > 0

  // --- of a coupling
  std::vector<double> jacobian = {};                   // J1 (nv), zero at balls and free joints
  std::vector<double> other = {};                      // J2 (nv); none: l2 = l0
  double reference = 0;                                // l0
  std::array<double, 5> polynomial = {0, 0, 0, 0, 0};  // c

  // --- how e returns to zero: Baumgarte's k = omega^2, b = 2 zeta omega
  double stiffness = 0;  // k [1/s^2]
  double damping = 0;    // b [1/s]
  bool velocity_terms =
      true;  // whether dJ/dt qd is taken; MuJoCo leaves it out of couplings, releases before 4 of all

  // --- how it gives way, R of its rows: of turning [1/(kg m^2) times s^2] and moving [1/kg]. Zero: it is exact. With an
  // impedance d, R = compliance (1 - d) / d, and k acts d times.
  std::array<double, 2> compliance = {0, 0};
  std::optional<Impedance> impedance = {};

  int rows() const { return kind == Kind::point ? 3 : kind == Kind::pose ? 6 : 1; }
};

}  // namespace kalmarm
