// Mechanisms on which covariance forms lose digits, up to all of them.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/test/models.hpp"

namespace kalmarm::test {

// Masses grow from the base to the tip.
inline Model<double> growing(std::uint64_t seed, double heaviest) {
  const Model<double> even = chain(seed);
  const int n = even.nv();
  std::vector<Joint<double>> joints;
  for (int k = 0; k < n; ++k) {
    joints.push_back(even.joint(k));
    const double by = std::pow(heaviest, k / (n - 1.0));
    joints[k].body.mass *= by;
    joints[k].body.moments *= by;
  }
  return {std::move(joints), even.names(), even.nq(), Vector3<double>::Zero()};
}

// Point masses at a fraction c < 1/2 of the length of each link: stretched out, errors grow by
// (1/c - 1)^2 a link.
inline Model<double> com_inboard(int n) {
  Builder builder;
  for (int k = 0; k < n; ++k) {
    Joint<double> joint;
    joint.parent = k - 1;
    if (k > 0) joint.translation = {1, 0, 0};
    joint.body = point_mass(1, {0.3, 0, 0});
    builder.add(joint);
  }
  return builder.build({0, 0, 0});
}

// Trees of hinges and slides with masses over twelve decades, lengths over four and armature over
// twelve, some axes nearly parallel.
inline Model<double> wild(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  const int n = 4 + random.below(16);
  const auto decades = [&](double low, double high) {
    return std::pow(10, random.uniform(low, high));
  };
  for (int k = 0; k < n; ++k) {
    const int parent = k == 0 ? -1 : random.chance(0.7) ? k - 1 : random.below(k);
    Joint<double> joint = random_joint(
        random, parent, random.chance(0.25) ? Coordinate::distance : Coordinate::angle);
    const double length = decades(-2, 2), mass = decades(-6, 6), radius = length * decades(-2, 0);
    joint.translation = length * random.vector3();
    joint.body.moments *= mass / joint.body.mass * radius * radius / 0.04;
    joint.body.com *= length;
    joint.body.mass = mass;
    if (random.chance(0.15)) joint.rotation = {1, 0, 0, random.uniform(-1, 1)};
    if (random.chance(0.1)) joint.rotation = {1, decades(-6, -1), 0, random.uniform(-1, 1)};
    if (random.chance(0.3)) joint.r = decades(-6, 6);
    builder.add(joint);
  }
  return builder.build();
}

}  // namespace kalmarm::test
