// A mechanism in a state as numbers in [0, 1]: what the adversary searches over (search.hpp).
//
// A number either stands for a scale, 10^U(low, high), or chooses: its first part for a special
// value, such as no offset, the rest for any. So special mechanisms are as frequent as written here
// in what is drawn at random, and a search may go from them to others.
//
// Of every body, 20 numbers:
//   parent      75 % the body before, else any before it
//   joint       65 % hinge, 20 % slide, 15 % ball; of the first body 5 % free. At most 9 DoF: a
//               joint of several DoF for which there is no room becomes a hinge
//   mass        10^U(-8,8)
//   offset      25 % none, else 10^U(-3,3); 60 % along a coordinate axis
//   axis        at an angle to the parent's of 0 (30 %), a right one (20 %), 10^U(-8,-1) (20 %) or
//               any; 40 % tilted about x
//   com         25 % on the axis, else 10^U(-3,3) away; 60 % along a coordinate axis
//   shape       20 % point, 15 % rod, else second moments m rho^2 (1, 10^U(-4,0), 10^U(-4,0)) with
//               rho = 10^U(-4,3), about axes that are the link's (50 %) or any
//   armature    70 % none, else 10^U(-6,6)
// Of the mechanism: no gravity (25 %) or 9.81 m/s^2; at rest (30 %) or velocities on a scale of
// 10^U(-3,3); no torques (15 %) or torques on a scale of 10^U(-6,6).
// Of every DoF:
//   q           angles: 15 % 0; 15 % k quarter turns, as rounded, k = -4 to 4; 15 % 10^U(-8,-1)
//               beside such an angle; 15 % 10^U(-8,0); else any. Lengths: 20 % 0, else 10^U(-3,3).
//               Of balls and free bodies any orientation
//   qd          U(-1,1) times its scale
//   tau         10 % 0, else 10^U(-8,8) times its scale
//
// A kernel of the library that answers special mechanisms alone gets such mechanisms, from the same
// numbers:
//   translational  slides alone
//   at rest        velocities are zero
#pragma once

#include <vector>

#include "algorithms/fast/engine/engine.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm::adversary {

inline constexpr int most_dofs = 9;

struct Genome {
  int bodies = 1;         // 1 to most_dofs
  std::vector<double> x;  // length_of(bodies) numbers in [0, 1]
};

struct Mechanism {
  Model<double> model;  // as the loader gives it from to_mjcf (robots/scene/write_mjcf.hpp)
  State state;
};

int length_of(int bodies);

Mechanism decode(const Genome& genome, Kernel kernel = Kernel::spatial);

}  // namespace kalmarm::adversary
