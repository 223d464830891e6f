// Branches, free bodies, and mechanisms at random.
#include <numbers>
#include <utility>

#include "accuracy/stress/parts.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm::stress {
namespace {

void add_free_body(Joints& joints, const RigidBody<double>& body) {
  Joint<double> slide;
  slide.slides = true;
  slide.coordinate = Coordinate::position;
  add_three(joints, slide);
  Joint<double> ball;
  ball.parent = 2;
  ball.coordinate = Coordinate::quaternion;
  ball.body = body;
  add_three(joints, ball);
}

Case floating_base(double distance, std::uint64_t seed) {
  Case out = at_random(torso(6, seed), seed);
  out.q.head<3>() *= distance / out.q.head<3>().norm();
  return out;
}

// The com is at half the length.
RigidBody<double> wild_body(Draw& draw) {
  RigidBody<double> body = draw.body(1);
  const double length = draw.power_of_ten(-2, 2);
  const double gyration = length * draw.power_of_ten(-3, 0);
  body.mass = draw.power_of_ten(-6, 6);
  body.com *= length;
  body.moments *= body.mass * gyration * gyration / body.moments.mean();
  return body;
}

Eigen::Quaternion<double> wild_turn(Draw& draw) {
  if (draw.chance(0.15)) return {1, 0, 0, 0};
  if (draw.chance(0.10 / 0.85)) return {1, draw.power_of_ten(-6, -1) / 2, 0, 0};
  return draw.turn();
}

Joint<double> wild_joint(Draw& draw, const Joints& inboard) {
  const int k = static_cast<int>(inboard.size());
  Joint<double> joint;
  joint.parent = k == 0 || draw.chance(0.7) ? k - 1 : draw.below(k);
  if (k > 0) joint.translation = 2 * inboard[joint.parent].body.com;
  joint.rotation = wild_turn(draw);
  joint.body = wild_body(draw);
  if (draw.chance(0.25)) {
    joint.slides = true;
    joint.coordinate = Coordinate::distance;
  }
  if (draw.chance(0.3)) joint.r = draw.power_of_ten(-6, 6);
  return joint;
}

}  // namespace

Model<double> torso(int links, std::uint64_t seed) {
  Draw draw(seed);
  Joints joints;
  add_free_body(joints, draw.body(1));
  for (int limb = 0; limb < 4; ++limb) {
    for (int link = 0; link < links; ++link) {
      Joint<double> joint;
      joint.parent = link == 0 ? 5 : static_cast<int>(joints.size()) - 1;
      joint.translation = link == 0 ? Vector3<double>(draw.direction() / 2)
                                    : Vector3<double>(2 * joints.back().body.com);
      joint.rotation = draw.turn();
      joint.body = draw.body(1);
      joints.push_back(joint);
    }
  }
  return assemble(std::move(joints), down);
}

Case wild_mechanism(std::uint64_t seed) {
  Draw draw(seed);
  Joints joints;
  for (int n = 4 + draw.below(20); n > 0; --n) joints.push_back(wild_joint(draw, joints));
  Case out = at_random(assemble(std::move(joints), down), seed);
  for (int k = 0; k < out.model.nv(); ++k) {  // slides within the length of their link
    const Joint<double>& joint = out.model.joint(k);
    if (joint.slides) out.q[k] *= 2 * joint.body.com.norm() / std::numbers::pi;
  }
  return out;
}

std::vector<Family> tree_families() {
  const std::vector<double> quick = {7, 15, 31, 63, 127};
  const std::vector<double> full = {1, 3, 7, 15, 31, 63, 127, 255, 511, 1023, 10000};
  return {
      {FamilyKind::tree, "tree", "N", "A binary tree of equal links.", true, quick, full,
       [](double N, std::uint64_t seed) {
         return at_random(auto_tree(static_cast<int>(N), 2, 1, down), seed);
       }},
      {FamilyKind::tree, "random_tree", "N",
       "A tree of random links with hinges, slides, ball joints and some armature.", true, quick,
       full,
       [](double N, std::uint64_t seed) {
         return at_random(random_tree(static_cast<int>(N), seed, 1), seed);
       }},
      {FamilyKind::tree,
       "torso",
       "links in a limb",
       "A free body with four limbs.",
       true,
       {2, 6, 12, 24},
       {1, 2, 4, 6, 8, 12, 16, 24, 36},
       [](double links, std::uint64_t seed) {
         return at_random(torso(static_cast<int>(links), seed), seed);
       }},
      {FamilyKind::tree, "floating_base", "distance [m]",
       "A free body with four limbs of six links, far from the origin of the world.", true,
       decades(0, 8, 2), decades(0, 16, 2), floating_base},
      {FamilyKind::wild,
       "wild",
       "none",
       "Any mechanism: all that is hard at once.",
       true,
       {1},
       {1},
       [](double, std::uint64_t seed) { return wild_mechanism(seed); }},
  };
}

}  // namespace kalmarm::stress
