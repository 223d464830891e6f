// Mechanisms that are hard on the algorithms. A family is a mechanism with one number to turn up.
//
// The base model is a random chain of N = 12 hinges (robots/families.hpp): links of length 1 and
// mass 1 in random directions, com at mid-link, principal moments from 0.04 to 0.12, all positions
// uniform in (-pi, pi). l(k), m(k), J(k) below are a link's length, mass and principal moments;
// "heavy" scales m and J, "long" scales l, com by s and J by s^2. A family is of that chain unless
// it says otherwise. k = 1..N.
//
// Length, value = N: autoTree, planar, gravity along -y, q given; random_chain is the base model.
//   straight q = 0    zigzag q = +-pi/2 in turn    bent q = 0.3    folded q = +-(pi - 1e-3) in turn
// Straight: with p = sqrt(J_z), D -> (1/2 + p)^2, g -> 1/(1/2 + p), condition -> 3.825 N^4.
// Above largest_inverse joints a case is for accelerations only.
//
// Mass, value = mass ratio rho:
//   heavy_tip  m(N) = rho     heavy_base  m(1) = rho     alternating  m(k) = rho for even k
//   growing  m(k) = rho^((k-1)/(N-1))    decaying  the reverse    random_masses  m(k) = rho^U(0,1)
//   heavy_point  m(8) = rho, J(8) as it was              flywheel  J(N) = rho J, m(N) = 1
//   planar_heavy  heavy tip on autoTree, planar          heavy_leaves  on a binary tree of 15
//   humanoid_torso, humanoid_feet  of `torso` below: the torso; the last links of two limbs
//
// Geometry: taper and inverse_taper  l(k) = s^((k-1)/(N-1)), m ~ l^3, J ~ l^5, value = s
//   short_links  every other l = value      light_links  the same with m ~ l^3, J ~ l^5
//   far_com  three hinges that meet, two massless links and a body, its com at value
//   base_offset  the first joint at a distance of value from the base's origin
//
// Axes: skew  angle between all successive axes of autoTree
//   axis_gap  axes 6 and 7 parallel, at a distance of value; link 6 scaled by 1e-30
//
// Rotations: point_masses  J scaled by value    rods  J = (value J_1, J_2, J_2) about the link's
// line
//
// Non-minimum phase: straight chain, com at c from the joint, J = (I, I, I), l = m = 1. With
// p = ((1-2c) + sqrt((1-2c)^2 + 4I)) / 2: D -> (c + p)^2, g -> 1/(c + p); for c >= 1/2 also
// min eigenvalue of M -> ((1-2c)^2 + 4I) / 16. For c < 1/2 errors grow by (1/c - 1)^2 a link.
//   non_minimum_phase  c = 0.3, N = 64, value = I        com_fraction  value = c, N = 32, I = 1e-12
//   non_minimum_phase_length  c = 0.3, I = 0, value = N  non_minimum_phase_bend  value = q of all,
//                                                        I = 1e-16, N = 64
//
// Joint noise: armature  r(k) = value     armature_heavy_tip  the same with m(N) = 1e12
//   stiff  implicit Euler with h = 1e-3 s: r = 0.01 + h b + h^2 value, b = 2 sqrt(value), on every
//          other joint
//
// Trees: tree  autoTree with branching 2 and skew 1, value = N    random_tree  of robots/, value =
// N
//   torso  a free body with four limbs of value hinges, nv = 6 + 4 value
//   floating_base  torso with limbs of 6, at a distance of value from the origin
//
// Units: mass_unit  m, J times value: M times value       length_unit  l times value, and gravity:
//   M times value^2. What lies beyond 1e+-30 overflows in float32.
//
// Singular at value 0, where some q' other than zero moves no mass and no rotor; the value is how
// far from it:
//   point_on_axis  the tip is a point mass, value off its axis
//   rod_on_axis    the tip is a rod along its axis, tilted by value [rad]
//   coaxial        no mass on link 6; axes 6 and 7 are parallel at a distance of value
//   gimbal_lock    axes 6, 7, 8 meet, no mass on links 6 and 7; axis 8 is at an angle of value to 6
//   point_on_ball  axes 10, 11, 12 meet, no mass on 10 and 11; the tip's radius of gyration is
//   value massless_tip   the tip scaled by value massless_slide joint 11 slides; links 11 and 12
//   scaled by value; joint 12 has armature 0.1
// These look singular at value 0 and are not:
//   massless_oblique  link 6, between oblique axes, scaled by value
//   point_off_axis    the tip is a point but for a radius of gyration of value
//
// wild: 4 to 23 joints; 70% hang on the one before, the others anywhere; 25% slide; m = 10^U(-6,6),
//   l = 10^U(-2,2), radius of gyration l 10^U(-3,0); 15% of the axes parallel to the parent's, 10%
//   at an angle of 10^U(-6,-1); 30% have armature 10^U(-6,6). Its only value is 1.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm::stress {

// One mechanism in one position.
struct Case {
  Model<double> model;    // with gravity (0, 0, -9.81) unless the family says otherwise
  VectorX<double> q, qd;  // qd: N(0,1)
};

struct Family {
  std::string name;       // such as "heavy_tip"
  std::string parameter;  // what the value is, with its unit: "mass ratio", "N", "gap [m]"
  std::string describes;  // one sentence for the report
  bool random = false;    // the seed changes the mechanism or q, and not qd alone
  std::vector<double> quick, full;  // values to sweep
  std::function<Case(double value, std::uint64_t seed)> make;
  std::vector<int> singular = {};  // joints that move no mass at value 0; empty: none, ever
};

inline constexpr int largest_inverse = 150;  // joints for which M^-1 and its truth are affordable

// All but the shipped robots, which are files.
const std::vector<Family>& families();

// Every shipped robot R, at random positions (seed):
//   R_payload      mass and inertia of the last link of the longest chain times value
//   R_light_wrist  mass and inertia of the last three links of that chain that have mass times
//   value R_pose         q = value times a random position: 0 is stretched out, 1 random R_armature
//   armature times value, 0 switches it off (robots that have any)
// Throws InputError where a robot's file is bad.
std::vector<Family> robot_families();

}  // namespace kalmarm::stress
