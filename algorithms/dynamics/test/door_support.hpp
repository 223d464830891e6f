// Robots and questions that the tests of the door share.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/fast/test/planar_support.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {

// All rules, those included that have to be asked for.
inline const DynamicsOptions by_all_rules{.rules = all_rules()};

// Some of everything: several parts, a plane, slides alone, a free trunk with limbs.
inline const std::vector<Family>& robots() {
  static const std::vector<Family> all{
      {"floating_base", [](std::uint64_t seed) { return floating_base(seed); }},
      {"forest", forest},
      {"creature", creature},
      {"planar_tree", planar_tree},
      {"planar_everything", planar_everything},
      {"eight_slides", [](std::uint64_t seed) { return slides_alone(seed, 8); }}};
  return all;
}

inline std::vector<Family> families_and_robots() {
  std::vector<Family> all = all_families();
  all.insert(all.end(), robots().begin(), robots().end());
  return all;
}

// One body on each kind of joint, without a rotor and with one.
inline std::vector<Model<double>> single_bodies() {
  std::vector<Model<double>> out;
  for (const auto add : {&Builder::add, &Builder::add_ball, &Builder::add_free})
    for (const double r : {0.0, 0.1}) {
      Random random(8);
      Builder builder;
      Joint<double> joint = random_joint(random, -1);
      joint.r = r;
      (builder.*add)(joint);
      out.push_back(builder.build());
    }
  return out;
}

// Links at which a joint of one DoF ends; others are parts of a ball or free joint.
inline bool is_single(const Model<double>& model, int k) {
  const Coordinate c = model.joint(k).coordinate;
  return c == Coordinate::angle || c == Coordinate::distance;
}

// The last DoF of the joint that ends at link k or after it.
inline int end_of_joint(const Model<double>& model, int k) {
  while (k + 1 < model.nv() && model.joint(k + 1).coordinate == Coordinate::follower) ++k;
  return k;
}

// Every third joint of one DoF.
inline std::vector<int> some_locked(const Model<double>& model) {
  std::vector<int> out;
  for (int k = 1; k < model.nv(); k += 3)
    if (is_single(model, k)) out.push_back(k);
  return out;
}

inline std::vector<int> all_but(int n, const std::vector<int>& some) {
  std::vector<int> out;
  for (int k = 0; k < n; ++k)
    if (!std::binary_search(some.begin(), some.end(), k)) out.push_back(k);
  return out;
}

inline std::vector<Frame> some_frames(const Model<double>& model) {
  return {{model.nv() - 1, {1, 0.2, -0.3, 0.1}, {0.1, 0, 0.2}}, {-1}, {model.nv() / 2}};
}

// Everything about some DoF, and three frames.
inline Question about(const std::vector<int>& dofs, const Model<double>& model) {
  Question question;
  question.dofs = dofs;
  question.frames = some_frames(model);
  return question;
}

}  // namespace kalmarm::test
