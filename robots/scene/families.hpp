// Families of mechanisms with N links of one DoF, N from 1 on, by exact generators.
//
//   straight  planar chain, stretched out (q = 0): autoTree of Featherstone's spatial_v2 with
//             branching 1, no skew and no taper: l = m = 1, com (l/2, 0, 0),
//             I_cm = diag(0.0025, 1.015/12, 1.015/12), z axes. Closed forms: with p = sqrt(I_zz),
//             D -> (1/2 + p)^2, g -> 1/(1/2 + p), condition of M -> 3.825 N^4. No gravity, at rest.
//   tree      the same with branching 2, parent(i) = floor(i/2), and a skew of 1 rad between axes.
//             Random states.
//   chain     random chain: joints turned by Rz(beta) Rx(alpha) with both angles uniform in
//             (-pi, pi), offsets of unit length in random directions, m = 1, com at mid-offset,
//             principal moments uniform in (0.04, 0.12) within the triangle inequality. One fixed
//             seed: chain:N is the same robot everywhere. Random states.
//   planar    the same bodies and offsets, but all axes are parallel, in a plane that is tilted.
//             Random states.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm {

struct Family {
  std::string name;
  bool at_rest;  // its state is part of the family: q = 0, qd = 0; only tau is random
  Model<double> (*make)(int links);
};

const std::vector<Family>& families();

// Drawn from a seed: the chain above, and a tree with all that Kalmarm adds to the paper's chains:
// branches, slides, ball joints (every fourth body; their first two links are massless) and
// armature of 0.1 (every third body). Every link hangs on one of the three before it. Masses are
// log-uniform from 1 to `heaviest`.
Model<double> random_chain(int links, std::uint64_t seed, double heaviest);
Model<double> random_tree(int links, std::uint64_t seed, double heaviest);

inline constexpr int largest_family_member = 1000;  // M^-1 of every variant is stored whole

}  // namespace kalmarm
