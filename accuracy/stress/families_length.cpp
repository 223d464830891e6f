// Long chains, and those with their com inboard of mid-link.
#include <numbers>

#include "accuracy/stress/parts.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm::stress {
namespace {

constexpr int phase_links = 64;

// autoTree in its plane, with q = bend, sign * bend, bend, ...
Case planar(double links, double bend, double sign, std::uint64_t seed) {
  const Model<double> model = auto_tree(static_cast<int>(links), 1, 0, in_plane);
  VectorX<double> q = VectorX<double>::Constant(model.nv(), bend);
  for (int k = 1; k < model.nv(); k += 2) q[k] *= sign;
  return at(model, q, seed);
}

// autoTree with the com at c and J = (I, I, I), and q = bend.
Case com_at(double c, double I, double links, double bend, std::uint64_t seed) {
  Case out = planar(links, bend, 1, seed);
  out.model = changed(out.model, [&](Joints& joints) {
    for (Joint<double>& joint : joints) {
      joint.body.com[0] = c;
      joint.body.moments.setConstant(I);
    }
  });
  return out;
}

}  // namespace

std::vector<Family> length_families() {
  using std::numbers::pi;
  const std::vector<double> quick = {4, 15, 31, 63, 127};
  const std::vector<double> full = {1, 2, 4, 8, 15, 31, 63, 127, 255, 511, 1000, 10000, 100000};
  std::vector<double> inertias = decades(-16, 0, 2);
  inertias.insert(inertias.begin(), 0);
  return {
      {FamilyKind::long_chain, "straight", "N", "Equal links stretched out in a line.", false,
       quick, full, [](double N, std::uint64_t seed) { return planar(N, 0, 1, seed); }},
      {FamilyKind::long_chain, "zigzag", "N",
       "Equal links, each at a right angle to the last, in stairs.", false, quick, full,
       [](double N, std::uint64_t seed) { return planar(N, pi / 2, -1, seed); }},
      {FamilyKind::long_chain, "bent", "N",
       "Equal links, each bent by 0.3 rad, so that the chain curls up.", false, quick, full,
       [](double N, std::uint64_t seed) { return planar(N, 0.3, 1, seed); }},
      {FamilyKind::long_chain, "folded", "N",
       "Equal links, each folded back on the last but for 1e-3 rad.", false, quick, full,
       [](double N, std::uint64_t seed) { return planar(N, pi - 1e-3, -1, seed); }},
      {FamilyKind::long_chain, "random_chain", "N",
       "Links of equal mass and length in random directions.", true, quick, full,
       [](double N, std::uint64_t seed) {
         return at_random(random_chain(static_cast<int>(N), seed, 1), seed);
       }},
      {FamilyKind::inboard_com,
       "non_minimum_phase",
       "inertia about the com [kg m^2]",
       "A straight chain of 64 links with their com at 0.3 of their length.",
       false,
       {0, 1e-16, 1e-8, 1e-4, 1},
       inertias,
       [](double I, std::uint64_t seed) { return com_at(0.3, I, phase_links, 0, seed); }},
      {FamilyKind::inboard_com,
       "non_minimum_phase_length",
       "N",
       "A straight chain of point masses at 0.3 of the length of each link.",
       false,
       {4, 8, 16, 32, 48},
       {2, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96},
       [](double N, std::uint64_t seed) { return com_at(0.3, 0, N, 0, seed); }},
      {FamilyKind::inboard_com,
       "non_minimum_phase_bend",
       "bend of every joint [rad]",
       "Near point masses at 0.3 of the length of each of 64 links, away from the straight line.",
       false,
       {0, 1e-2, 0.1, 0.3},
       {0, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2, 0.3},
       [](double bend, std::uint64_t seed) { return com_at(0.3, 1e-16, phase_links, bend, seed); }},
      {FamilyKind::inboard_com,
       "com_fraction",
       "com as a fraction of the link",
       "Near point masses on 32 straight links: through mid-link, where errors start to grow.",
       false,
       {0.1, 0.3, 0.5, 0.7, 0.9},
       {0.1, 0.2, 0.3, 0.4, 0.45, 0.5, 0.55, 0.6, 0.7, 0.8, 0.9},
       [](double c, std::uint64_t seed) { return com_at(c, 1e-12, 32, 0, seed); }},
  };
}

}  // namespace kalmarm::stress
