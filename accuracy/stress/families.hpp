// Mechanisms that are hard on the algorithms. A family is a mechanism with one number to turn up,
// `value`.
//
// The base model is a random chain of N = 12 hinges (robots/scene/families.hpp): links of length l = 1
// and mass m = 1 in random directions, com at mid-link, principal moments J from 0.04 to 0.12,
// gravity along -z, positions uniform in (-pi, pi). A family changes the base model unless it names
// another. Links are counted from 1. To scale a body is to scale m and J; to scale a length, l and
// com, and J by its square.
//
// Length. autoTree in its plane, gravity along -y; value = N. With p = sqrt(J_z):
// D -> (1/2 + p)^2, g -> 1/(1/2 + p), condition of M -> 3.825 N^4 where the chain is straight.
//   straight, zigzag      q = 0;   q = +-pi/2 in turn
//   bent, folded          q = 0.3; q = +-(pi - 1e-3) in turn
//   random_chain          the base model
// With more than largest_inverse joints, cases are for accelerations alone.
//
// Mass. value = rho, the ratio of the heaviest to the lightest body.
//   heavy_tip, heavy_base m(N) = rho; m(1) = rho; the body is scaled, here and below
//   alternating           m(k) = rho for even k
//   growing, decaying     m(k) = rho^((k-1)/(N-1)); rho^((N-k)/(N-1))
//   random_masses         m(k) = rho^U(0,1)
//   heavy_point, flywheel m(8) = rho and J as it was; J(N) scaled by rho and m as it was
//   planar_heavy          heavy_tip on autoTree in its plane
//   heavy_leaves          on autoTree with branching 2, skew 1 and N = 15
//   humanoid_torso, _feet on `torso` with limbs of 6: its body; the last links of two limbs
//
// Geometry. value = a length [m].
//   taper, inverse_taper  l(k) = value^((k-1)/(N-1)), m ~ l^3, J ~ l^5; value <= 1; value >= 1
//   short_links           l = value for even k
//   light_links           the same with m ~ l^3, J ~ l^5
//   far_com               three hinges that meet carry one body, its com at a distance of value
//   base_offset           joint 1 is at a distance of value from the base's origin
//   axis_gap              axes 6 and 7 are parallel, value apart; body 6 is scaled by 1e-30
//   skew                  autoTree, N = 12; value = angle between successive axes [rad]
//
// Shape. value = a factor.
//   point_masses, rods    J scaled by value; J = (value J_1, J_2, J_2) about the link's line
//
// Com inboard of mid-link. A straight chain with the com at c and J = (I, I, I). With
// p = ((1-2c) + sqrt((1-2c)^2 + 4I)) / 2: D -> (c + p)^2, g -> 1/(c + p); for c >= 1/2 the least
// eigenvalue of M -> ((1-2c)^2 + 4I) / 16. For c < 1/2 and small I, errors in P grow by
// (1/c - 1)^2 a link.
//   non_minimum_phase     value = I [kg m^2]; c = 0.3, N = 64
//   non_minimum_phase_length  value = N; c = 0.3, I = 0
//   non_minimum_phase_bend    value = every q [rad]; c = 0.3, I = 1e-16, N = 64
//   com_fraction          value = c; I = 1e-12, N = 32
//
// Joint noise.
//   armature              r = value on every joint [kg m^2]
//   armature_heavy_tip    the same with m(N) = 1e12
//   stiff                 implicit Euler, h = 1e-3 s, stiffness s = value on every other joint:
//                         r = 0.01 + h b + h^2 s, b = 2 sqrt(s)
//
// Implicit steps. r = armature + h b + h^2 value on every hinge and slide, b = 2 sqrt(value); h = 2 ms.
//   step_gain             the base model; value = k [N m/rad]
//   step_size             the same with k = 1e6; value = h [s]
//   step_heavy_tip        step_gain with m(N) = 1e6
//   step_tree             the same of random_tree, N = 31
//   step_length           the base model with k = 1e6; value = N
//   step_wild             of `wild` 70% of the joints, k = value 10^U(-2,0), h = 10^U(-4,-1.7)
//
// Trees and free bodies.
//   tree, random_tree     autoTree with branching 2 and skew 1; that of robots/; value = N
//   torso                 a free body with four limbs of value hinges: nv = 6 + 4 value
//   floating_base         the same, limbs of 6, value from the world's origin [m]
//
// Units. M is scaled by value; by value^2. Full sweeps leave the range of float32.
//   mass_unit             every body scaled
//   length_unit           every length scaled, and gravity
//
// Singular at value 0, where some q' other than zero moves no mass and no rotor.
//   point_on_axis         the tip is a point mass, value off its axis
//   rod_on_axis           the tip is a rod along its axis, tilted by value [rad]
//   coaxial               axes 6 and 7 are parallel, value apart; body 6 has no mass
//   gimbal_lock           axes 6, 7, 8 meet, value is the angle of 8 to 6; bodies 6, 7 have no mass
//   point_on_ball         axes 10, 11, 12 meet, bodies 10, 11 have no mass, and the tip is a point
//                         but for a radius of gyration of value
//   massless_tip          body 12 scaled by value
//   massless_slide        joint 11 slides, bodies 11 and 12 scaled by value; r(12) = 0.1
// These only look singular at value 0:
//   massless_oblique      body 6, between oblique axes, scaled by value
//   point_off_axis        the tip is a point but for a radius of gyration of value
//
//   wild                  4 to 23 joints; 70% hang on the one before, the others anywhere; 25%
//                         slide; m = 10^U(-6,6), l = 10^U(-2,2), radius of gyration l 10^U(-3,0);
//                         axes at an angle to the parent's of 0 (15%), 10^U(-6,-1) (10%) or any;
//                         r = 10^U(-6,6) on 30%. Its only value is 1.
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

// What is hard about a family; the report tells of each kind by itself.
enum class FamilyKind {
  long_chain,
  heavy_outboard,  // heavy bodies on light ones: payloads, feet
  heavy_inboard,   // light bodies on heavy ones, or mixed
  uneven_lengths,
  near_parallel_axes,
  point_masses,
  inboard_com,
  joint_noise,
  tree,
  units,
  singular,  // singular at value 0, or looks so
  robot,     // a shipped one
  wild,      // drawn at random: many mechanisms of one value
};

const char* to_string(FamilyKind kind);

struct Family {
  FamilyKind kind;
  std::string name;       // such as "heavy_tip"
  std::string parameter;  // what the value is, with its unit: "mass ratio", "N", "gap [m]"
  std::string describes;  // one sentence for the report
  bool random = false;    // the seed changes the mechanism or q, and not qd alone
  std::vector<double> quick, full;  // values to sweep
  std::function<Case(double value, std::uint64_t seed)> make;
  std::vector<int> singular = {};  // joints (from 0) that move no mass at value 0; mostly none
};

inline constexpr int largest_inverse = 150;  // joints for which M^-1 and its truth are affordable

// All but the shipped robots, which are files.
const std::vector<Family>& families();

// Every shipped robot R, at random positions. Its longest chain is the one with most joints; links
// without mass do not count.
//   R_payload             the last link of that chain scaled by value
//   R_light_wrist         its last three links scaled by value
//   R_pose                q = value times a random position: 0 is stretched out
//   R_armature            armature times value (robots that have any): 0 switches it off
// Throws InputError where a robot's file is bad.
std::vector<Family> robot_families();

}  // namespace kalmarm::stress
