#include "robots/families.hpp"

#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_on_sphere.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <cmath>
#include <numbers>
#include <utility>

namespace kalmarm {
namespace {

using Quaternion = Eigen::Quaternion<double>;
using Vec3 = Vector3<double>;

Model<double> assemble(std::vector<Joint<double>> joints, const Vec3& gravity) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < joints.size(); ++k) {
    joints[k].q_index = static_cast<int>(k);
    names.push_back("joint" + std::to_string(k));
  }
  const int nq = static_cast<int>(joints.size());
  return {std::move(joints), std::move(names), nq, gravity};
}

// Link i (from 1) of autoTree hangs on floor((i - 2 + branching) / branching). Links are numbered
// depth first here, as MuJoCo does.
Model<double> auto_tree(int links, int branching, double skew, const Vec3& gravity) {
  Joint<double> joint;
  joint.rotation = Quaternion(std::cos(skew / 2), std::sin(skew / 2), 0, 0);
  joint.body.mass = 1;
  joint.body.com = Vec3(0.5, 0, 0);
  joint.body.moments = Vec3(0.0025, 1.015 / 12, 1.015 / 12);

  std::vector<Joint<double>> joints;
  std::vector<std::pair<int, int>> todo = {{1, -1}};  // link of autoTree, its parent here
  while (!todo.empty()) {
    const auto [i, parent] = todo.back();
    todo.pop_back();
    const int k = static_cast<int>(joints.size());
    joint.parent = parent;
    joint.translation = parent < 0 ? Vec3(0, 0, 0) : Vec3(1, 0, 0);
    joints.push_back(joint);
    for (int child = std::min(links, branching * i + 1); child > branching * (i - 1) + 1; --child)
      todo.emplace_back(child, k);
  }
  return assemble(std::move(joints), gravity);
}

Model<double> straight(int links) { return auto_tree(links, 1, 0, Vec3::Zero()); }

Model<double> tree(int links) { return auto_tree(links, 2, 1, Vec3(0, 0, -9.81)); }

Model<double> chain(int links) {
  boost::random::mt19937_64 random(1987);
  boost::random::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi),
      moment(0.04, 0.12);
  boost::random::uniform_on_sphere<double, std::vector<double>> direction(3);
  std::vector<Joint<double>> joints(links);
  for (int k = 0; k < links; ++k) {
    Joint<double>& joint = joints[k];
    joint.parent = k - 1;
    if (k > 0) joint.translation = 2 * joints[k - 1].body.com;
    const double alpha = angle(random), beta = angle(random);
    joint.rotation = Quaternion(std::cos(beta / 2), 0, 0, std::sin(beta / 2)) *
                     Quaternion(std::cos(alpha / 2), std::sin(alpha / 2), 0, 0);
    const std::vector<double> offset = direction(random);
    joint.body.mass = 1;
    joint.body.com = Vec3(offset[0], offset[1], offset[2]) / 2;
    Vec3& J = joint.body.moments;
    do {
      for (double& entry : J) entry = moment(random);
    } while (2 * J.maxCoeff() > J.sum());
  }
  return assemble(std::move(joints), Vec3(0, 0, -9.81));
}

}  // namespace

const std::vector<Family>& families() {
  static const std::vector<Family> all = {
      {"straight", true, straight}, {"chain", false, chain}, {"tree", false, tree}};
  return all;
}

}  // namespace kalmarm
