// A robot as plain numbers: what Dynamics is made from, and what ModelBuilder and the loader of
// robot files give. The layout of these types does not depend on a compiler's flags.
//
// A robot is a tree of links; each has one degree of freedom (DoF) on its inboard side, whose axis
// is the link's z axis. A joint of several DoF is several links, all but the last without inertia.
// Where a link stands in its parent's frame (phi(parent, k) of the paper) is rotation E and
// translation d, and what q adds to them:
//
//   angle       R = E Rz(q - reference),  p = d                          hinge
//   distance    R = E,                    p = d + (q - reference) E e_z  slide
//   quaternion  R = E R(q[0..3]) C,       p = d                          first DoF of a ball joint
//   position    R = E C,                  p = d + E q[0..2]              first DoF of a free joint
//   follower    R = C,                    p = 0                          its other DoF
//
// C is the turn that takes axes (x, y, z) to (y, z, x). A free joint is a position, which slides,
// then a quaternion: 7 entries of q, 6 DoF. Its velocity is the linear one along the axes of E,
// then the angular one in the body's axes, as in MuJoCo. Units: m, kg, s, rad.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace kalmarm {

enum class Coordinate { angle, distance, quaternion, position, follower };

// Entries of q that a DoF reads.
constexpr int q_entries(Coordinate coordinate) {
  switch (coordinate) {
    case Coordinate::quaternion:
      return 4;
    case Coordinate::position:
      return 3;
    case Coordinate::follower:
      return 0;
    default:
      return 1;
  }
}

// One DoF and the link outboard of it. Quaternions are (w, x, y, z), of any length but zero.
struct LinkParameters {
  int parent = -1;  // link on the inboard side, before this one in the order; -1: the fixed base
  Coordinate coordinate = Coordinate::angle;
  bool slides = false;   // moves along z; else it turns about z
  int q_index = 0;       // first entry of q that it reads
  double reference = 0;  // q at which the link is at its placement [rad or m]
  std::array<double, 4> rotation = {1, 0, 0, 0};        // E
  std::array<double, 3> translation = {0, 0, 0};        // d [m]
  double armature = 0;                                  // r(k) >= 0 [kg m^2 or kg]
  double mass = 0;                                      // [kg]
  std::array<double, 3> center_of_mass = {0, 0, 0};     // in the link's frame [m]
  std::array<double, 4> inertia_axes = {1, 0, 0, 0};    // principal axes in the link's frame
  std::array<double, 3> principal_moments = {0, 0, 0};  // about the centre of mass [kg m^2]
};

struct RobotModel {
  std::vector<LinkParameters> links = {};  // parents before children; DoF k has velocity k
  std::vector<std::string> names = {};     // of the DoF
  int nq = 0;
  std::array<double, 3> gravity = {0, 0, -9.81};  // [m/s^2]

  int nv() const { return static_cast<int>(links.size()); }
};

// A frame on a link: where a motion is asked for, or where a force acts. Its velocity, in its own
// axes and of its own origin, is (angular; linear) = J qd.
struct Frame {
  int link = -1;                                  // -1: the fixed base
  std::array<double, 4> rotation = {1, 0, 0, 0};  // its axes in the link's
  std::array<double, 3> translation = {0, 0, 0};  // its origin in the link's frame [m]
};

// Of a frame's spatial vectors. local: its own axes and origin; aligned: the base's axes, its own origin;
// world: the base's axes and origin.
enum class Axes { local, world, aligned };

}  // namespace kalmarm
