// Heavy links among light ones.
#include <cmath>

#include "accuracy/stress/parts.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm::stress {
namespace {

void heavy_tip(Joints& joints, double rho) { make_heavy(joints.back().body, rho); }

void growing(Joints& joints, double rho) {  // from link 1 to link N
  const int n = static_cast<int>(joints.size());
  for (int k = 0; k < n; ++k) make_heavy(joints[k].body, std::pow(rho, k / (n - 1.0)));
}

void alternating(Joints& joints, double rho) {
  for (std::size_t k = 1; k < joints.size(); k += 2) make_heavy(joints[k].body, rho);
}

void heavy_leaves(Joints& joints, double rho) {
  std::vector<bool> leaf(joints.size(), true);
  for (const Joint<double>& joint : joints)
    if (joint.parent >= 0) leaf[joint.parent] = false;
  for (std::size_t k = 0; k < joints.size(); ++k)
    if (leaf[k]) make_heavy(joints[k].body, rho);
}

Case random_masses(double rho, std::uint64_t seed) {
  const Model<double> chain = random_chain(base_links, seed, rho);
  return at_random(changed(chain,
                           [](Joints& joints) {
                             for (Joint<double>& joint : joints)
                               joint.body.moments *= joint.body.mass;
                           }),
                   seed);
}

Case planar_heavy(double rho, std::uint64_t seed) {
  const Model<double> chain = auto_tree(base_links, 1, 0, in_plane);
  return at_random(changed(chain, [&](Joints& joints) { heavy_tip(joints, rho); }), seed);
}

Case binary_tree(double rho, std::uint64_t seed) {
  const Model<double> tree = auto_tree(15, 2, 1, down);
  return at_random(changed(tree, [&](Joints& joints) { heavy_leaves(joints, rho); }), seed);
}

// A torso with limbs of six joints, of which `links` are heavy.
std::function<Case(double, std::uint64_t)> humanoid(const std::vector<int>& links) {
  return [links](double rho, std::uint64_t seed) {
    return at_random(changed(torso(6, seed),
                             [&](Joints& joints) {
                               for (const int k : links) make_heavy(joints[k].body, rho);
                             }),
                     seed);
  };
}

}  // namespace

std::vector<Family> mass_families() {
  const char* const ratio = "mass ratio";
  const Sweep sweep = mass_ratios();
  std::vector<Family> all = on_chain({
      {FamilyKind::heavy_outboard,
       "heavy_tip",
       ratio,
       "A chain with a heavy last link.",
       {sweep.quick, decades(0, 24, 1)},
       heavy_tip},  // every decade: slopes are fitted within the few of float32
      {FamilyKind::heavy_inboard, "heavy_base", ratio, "A chain with a heavy first link.", sweep,
       [](Joints& joints, double rho) { make_heavy(joints[0].body, rho); }},
      {FamilyKind::heavy_inboard, "alternating", ratio, "A chain of light and heavy links in turn.",
       sweep, alternating},
      {FamilyKind::heavy_outboard, "growing", ratio,
       "A chain whose links get heavier towards the tip.", sweep, growing},
      {FamilyKind::heavy_inboard, "decaying", ratio,
       "A chain whose links get lighter towards the tip.", sweep,
       [](Joints& joints, double rho) {
         growing(joints, 1 / rho);
         for (Joint<double>& joint : joints) make_heavy(joint.body, rho);
       }},
      {FamilyKind::heavy_outboard, "heavy_point", ratio,
       "A chain with a heavy link that is hard to move but easy to turn.", sweep,
       [](Joints& joints, double rho) { joints[7].body.mass *= rho; }},
      {FamilyKind::heavy_outboard, "flywheel", "inertia ratio",
       "A chain whose last link is hard to turn but easy to move.", sweep,
       [](Joints& joints, double rho) { joints.back().body.moments *= rho; }},
  });
  const auto add = [&](FamilyKind kind, const char* name, const char* describes, const auto& make) {
    all.push_back({kind, name, ratio, describes, true, sweep.quick, sweep.full, make});
  };
  add(FamilyKind::heavy_inboard, "random_masses", "A chain of links with log-uniform masses.",
      random_masses);
  add(FamilyKind::heavy_outboard, "planar_heavy", "A planar chain with a heavy last link.",
      planar_heavy);
  add(FamilyKind::heavy_inboard, "heavy_leaves", "A binary tree with heavy leaves.", binary_tree);
  add(FamilyKind::heavy_inboard, "humanoid_torso", "A free body with four limbs, the body heavy.",
      humanoid({5}));
  add(FamilyKind::heavy_outboard, "humanoid_feet",
      "A free body with four limbs, the ends of two of them heavy.", humanoid({11, 17}));
  return all;
}

}  // namespace kalmarm::stress
