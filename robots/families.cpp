#include "robots/families.hpp"

#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_int_distribution.hpp>
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
  int nq = 0;
  for (std::size_t k = 0; k < joints.size(); ++k) {
    names.push_back("joint" + std::to_string(k));
    if (joints[k].coordinate == Coordinate::follower) continue;
    joints[k].q_index = nq;
    nq += joints[k].coordinate == Coordinate::quaternion ? 4 : 1;
  }
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

// Turns, offsets and inertias of the random families.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}

  Quaternion turn() {  // Rz(beta) Rx(alpha)
    const double alpha = angle_(random_), beta = angle_(random_);
    return Quaternion(std::cos(beta / 2), 0, 0, std::sin(beta / 2)) *
           Quaternion(std::cos(alpha / 2), std::sin(alpha / 2), 0, 0);
  }

  // The com is at the middle of an offset of unit length; masses are log-uniform up to `heaviest`.
  RigidBody<double> body(double heaviest) {
    const std::vector<double> offset = direction_(random_);
    RigidBody<double> body;
    body.mass = heaviest == 1 ? 1 : std::pow(heaviest, share_(random_));
    body.com = Vec3(offset[0], offset[1], offset[2]) / 2;
    do {
      for (double& entry : body.moments) entry = moment_(random_);
    } while (2 * body.moments.maxCoeff() > body.moments.sum());
    return body;
  }

  int below(int n) { return boost::random::uniform_int_distribution<int>(0, n - 1)(random_); }

 private:
  boost::random::mt19937_64 random_;
  boost::random::uniform_real_distribution<double> angle_{-std::numbers::pi, std::numbers::pi};
  boost::random::uniform_real_distribution<double> moment_{0.04, 0.12};
  boost::random::uniform_real_distribution<double> share_{0, 1};
  boost::random::uniform_on_sphere<double, std::vector<double>> direction_{3};
};

Model<double> straight(int links) { return auto_tree(links, 1, 0, Vec3::Zero()); }

Model<double> tree(int links) { return auto_tree(links, 2, 1, Vec3(0, 0, -9.81)); }

Model<double> chain(int links) { return random_chain(links, 1987, 1); }

}  // namespace

const std::vector<Family>& families() {
  static const std::vector<Family> all = {
      {"straight", true, straight}, {"chain", false, chain}, {"tree", false, tree}};
  return all;
}

Model<double> random_chain(int links, std::uint64_t seed, double heaviest) {
  Draw draw(seed);
  std::vector<Joint<double>> joints(links);
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
  std::vector<Joint<double>> joints;
  std::vector<Vec3> tips;  // of every link, where the next one may hang
  const auto add = [&](const Joint<double>& joint, const Vec3& tip) {
    joints.push_back(joint);
    tips.push_back(tip);
  };
  for (int body = 0; static_cast<int>(joints.size()) < links; ++body) {
    Joint<double> joint;
    const int k = static_cast<int>(joints.size());
    joint.parent = k == 0 ? -1 : draw.below(std::min(k, 3)) + std::max(k - 3, 0);
    // a ball joint's massless links carry nothing else
    while (joint.parent >= 0 && joints[joint.parent].body.massless()) ++joint.parent;
    if (joint.parent >= 0) joint.translation = tips[joint.parent];
    joint.rotation = draw.turn();
    joint.body = draw.body(heaviest);
    const Vec3 tip = 2 * joint.body.com;
    if (body % 4 == 2 && links - k >= 3) {  // a ball joint: three turns, two of massless links
      const RigidBody<double> inertia = std::exchange(joint.body, {});
      joint.coordinate = Coordinate::quaternion;
      add(joint, Vec3::Zero());
      Joint<double> follower;
      follower.coordinate = Coordinate::follower;
      follower.parent = k;
      add(follower, Vec3::Zero());
      follower.parent = k + 1;
      follower.body = inertia;
      add(follower, tip);
    } else {
      if (body % 4 == 1) {
        joint.slides = true;
        joint.coordinate = Coordinate::distance;
      }
      if (body % 3 == 0) joint.r = 0.1;
      add(joint, tip);
    }
  }
  return assemble(std::move(joints), Vec3(0, 0, -9.81));
}

}  // namespace kalmarm
