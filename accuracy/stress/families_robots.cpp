// Stressed versions of the shipped robots.
#include <algorithm>
#include <memory>
#include <utility>

#include "accuracy/stress/parts.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm::stress {
namespace {

using Robot = std::shared_ptr<const Scene>;

// The links with mass on the longest chain, tip first.
std::vector<int> longest_chain(const Model<double>& model) {
  std::vector<int> depth(model.nv());
  for (int k = 0; k < model.nv(); ++k)
    depth[k] = model.parent(k) < 0 ? 1 : depth[model.parent(k)] + 1;
  std::vector<int> chain;
  const auto deepest = std::max_element(depth.begin(), depth.end());
  for (int k = static_cast<int>(deepest - depth.begin()); k >= 0; k = model.parent(k))
    if (!model.joint(k).body.massless()) chain.push_back(k);
  return chain;
}

Case at_random(const Robot& robot, const Model<double>& model, std::uint64_t seed) {
  State state = random_states(*robot, 1, seed)[0];
  return {model, std::move(state.q), std::move(state.qd)};
}

// Entries of q for which nothing is turned or moved.
VectorX<double> stretched_out(const Model<double>& model) {
  VectorX<double> q = VectorX<double>::Zero(model.nq());
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).coordinate == Coordinate::quaternion) q[model.joint(k).q_index] = 1;
  return q;
}

// Links scaled in mass and inertia.
auto heavy(const Robot& robot, const std::vector<int>& links) {
  return [robot, links](double factor, std::uint64_t seed) {
    return at_random(robot,
                     changed(robot->model,
                             [&](Joints& joints) {
                               for (const int k : links) make_heavy(joints[k].body, factor);
                             }),
                     seed);
  };
}

auto pose(const Robot& robot) {
  return [robot](double share, std::uint64_t seed) {
    Case out = at_random(robot, robot->model, seed);
    const VectorX<double> straight = stretched_out(out.model);
    out.q = straight + share * (out.q - straight);
    return out;
  };
}

auto armature(const Robot& robot) {
  return [robot](double factor, std::uint64_t seed) {
    return at_random(robot,
                     changed(robot->model,
                             [&](Joints& joints) {
                               for (Joint<double>& joint : joints) joint.r *= factor;
                             }),
                     seed);
  };
}

bool has_armature(const Model<double>& model) {
  bool any = false;
  for (int k = 0; k < model.nv(); ++k) any = any || model.joint(k).r > 0;
  return any;
}

void add_families(const std::string& name, std::vector<Family>& all) {
  const Robot robot = std::make_shared<const Scene>(load_scene(name));
  const std::vector<int> chain = longest_chain(robot->model);
  const int wrist_links = std::min(3, static_cast<int>(chain.size()) - 1);  // all would be a unit
  const std::vector<int> tip = {chain[0]}, wrist(chain.begin(), chain.begin() + wrist_links);
  all.push_back({FamilyKind::robot, name + "_payload", "times the last link's mass",
                 name + " with a heavy last link.", true, decades(0, 9, 3), decades(0, 12, 1),
                 heavy(robot, tip)});
  all.push_back({FamilyKind::robot, name + "_light_wrist", "times the wrist's mass",
                 name + " with three light last links.", true, decades(-9, 0, 3),
                 decades(-12, 0, 1), heavy(robot, wrist)});
  all.push_back({FamilyKind::robot,
                 name + "_pose",
                 "share of a random position",
                 name + " from stretched out to a random position.",
                 true,
                 {0, 1e-2, 0.1, 1},
                 {0, 1e-6, 1e-4, 1e-3, 1e-2, 0.1, 0.2, 0.5, 1},
                 pose(robot)});
  if (has_armature(robot->model))
    all.push_back({FamilyKind::robot,
                   name + "_armature",
                   "times the armature",
                   name + " with less armature, and with none.",
                   true,
                   {0, 1e-4, 1e-2, 1},
                   {0, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1},
                   armature(robot)});
}

}  // namespace

std::vector<Family> robot_families() {
  std::vector<Family> all;
  for (const std::string& name : shipped_robots()) add_families(name, all);
  return all;
}

}  // namespace kalmarm::stress
