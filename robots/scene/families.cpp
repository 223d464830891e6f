#include "robots/scene/families.hpp"

#include <algorithm>
#include <utility>

#include "robots/scene/generate.hpp"

namespace kalmarm {
namespace {

using Vec3 = Vector3<double>;

Model<double> straight(int links) { return auto_tree(links, 1, 0, Vec3::Zero()); }

Model<double> tree(int links) { return auto_tree(links, 2, 1, Vec3(0, 0, -9.81)); }

Model<double> chain(int links) { return random_chain(links, 1987, 1); }

Model<double> planar(int links) {
  Draw draw(1987);
  Joints joints(links);
  for (int k = 0; k < links; ++k) {
    Joint<double>& joint = joints[k];
    joint.parent = k - 1;
    joint.rotation = k == 0 ? draw.turn() : Eigen::Quaternion<double>::Identity();
    if (k > 0) joint.translation = 2 * joints[k - 1].body.com;
    joint.body = draw.body(1);
  }
  return assemble(std::move(joints), Vec3(0, 0, -9.81));
}

}  // namespace

const std::vector<Family>& families() {
  static const std::vector<Family> all = {{"straight", true, straight},
                                          {"chain", false, chain},
                                          {"tree", false, tree},
                                          {"planar", false, planar}};
  return all;
}

Model<double> random_chain(int links, std::uint64_t seed, double heaviest) {
  Draw draw(seed);
  Joints joints(links);
  for (int k = 0; k < links; ++k) {
    Joint<double>& joint = joints[k];
    joint.parent = k - 1;
    if (k > 0) joint.translation = 2 * joints[k - 1].body.com;
    joint.rotation = draw.turn();
    joint.body = draw.body(heaviest);
  }
  return assemble(std::move(joints), Vec3(0, 0, -9.81));
}

Model<double> random_tree(int links, std::uint64_t seed, double heaviest) {
  Draw draw(seed);
  Joints joints;
  std::vector<Vec3> tips;  // of every link, where the next one may hang
  for (int body = 0; static_cast<int>(joints.size()) < links; ++body) {
    Joint<double> joint;
    const int k = static_cast<int>(joints.size());
    joint.parent = k == 0 ? -1 : draw.below(std::min(k, 3)) + std::max(k - 3, 0);
    // a ball joint's massless links carry nothing else
    while (joint.parent >= 0 && joints[joint.parent].body.massless()) ++joint.parent;
    if (joint.parent >= 0) joint.translation = tips[joint.parent];
    joint.rotation = draw.turn();
    joint.body = draw.body(heaviest);
    if (body % 4 == 2 && links - k >= 3) {  // a ball joint: three turns, two of massless links
      joint.coordinate = Coordinate::quaternion;
      add_three(joints, joint);
    } else {
      if (body % 4 == 1) {
        joint.slides = true;
        joint.coordinate = Coordinate::distance;
      }
      if (body % 3 == 0) joint.r = 0.1;
      joints.push_back(joint);
    }
    tips.resize(joints.size(), 2 * joint.body.com);
  }
  return assemble(std::move(joints), Vec3(0, 0, -9.81));
}

}  // namespace kalmarm
