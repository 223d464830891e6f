#include "robots/scene/generate.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace kalmarm {

Model<double> assemble(Joints joints, const Vector3<double>& gravity) {
  std::vector<std::string> names;
  int nq = 0;
  for (std::size_t k = 0; k < joints.size(); ++k) {
    names.push_back("joint" + std::to_string(k));
    if (joints[k].coordinate == Coordinate::follower) continue;
    joints[k].q_index = nq;
    nq += q_entries(joints[k].coordinate);
  }
  return {std::move(joints), std::move(names), nq, gravity};
}

void add_three(Joints& joints, Joint<double> first) {
  Joint<double> follower;
  follower.slides = first.slides;
  follower.coordinate = Coordinate::follower;
  const RigidBody<double> body = std::exchange(first.body, {});
  joints.push_back(first);
  for (int i = 0; i < 2; ++i) {
    follower.parent = static_cast<int>(joints.size()) - 1;
    joints.push_back(follower);
  }
  joints.back().body = body;
}

// Link i (from 1) of autoTree hangs on floor((i - 2 + branching) / branching). Links are numbered
// depth first here, as MuJoCo does.
Model<double> auto_tree(int links, int branching, double skew, const Vector3<double>& gravity) {
  Joint<double> joint;
  joint.rotation = {std::cos(skew / 2), std::sin(skew / 2), 0, 0};
  joint.body.mass = 1;
  joint.body.com = {0.5, 0, 0};
  joint.body.moments = {0.0025, 1.015 / 12, 1.015 / 12};

  Joints joints;
  std::vector<std::pair<int, int>> todo = {{1, -1}};  // link of autoTree, its parent here
  while (!todo.empty()) {
    const auto [i, parent] = todo.back();
    todo.pop_back();
    const int k = static_cast<int>(joints.size());
    joint.parent = parent;
    joint.translation = {parent < 0 ? 0.0 : 1.0, 0, 0};
    joints.push_back(joint);
    for (int child = std::min(links, branching * i + 1); child > branching * (i - 1) + 1; --child)
      todo.emplace_back(child, k);
  }
  return assemble(std::move(joints), gravity);
}

}  // namespace kalmarm
