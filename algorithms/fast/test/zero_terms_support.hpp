// Mechanisms whose axes are parallel, at a right angle or meet.
#pragma once

#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {

inline const Eigen::Quaterniond same(1, 0, 0, 0), right(1, 1, 0, 0);  // of any length: exact

inline Joint<double> placed(Random& random, int parent, const Eigen::Quaterniond& rotation,
                            const Vector3<double>& translation) {
  Joint<double> joint = random_joint(random, parent);
  joint.rotation = rotation;
  joint.translation = translation;
  joint.ref = 0;
  return joint;
}

inline Model<double> chain_of(const Eigen::Quaterniond& rotation,
                              const Vector3<double>& translation, int n) {
  Random random(3);
  Builder builder;
  for (int k = 0; k < n; ++k) builder.add(placed(random, k - 1, rotation, translation));
  return builder.build();
}

// A tree of hinges and slides, one after another or not, with rotors or not, where any term may be
// zero.
inline Model<double> like_a_robot(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  const Eigen::Quaterniond rotations[] = {same,         right,        {1, -1, 0, 0},
                                          {0, 1, 0, 0}, {1, 1, 1, 1}, random.quaternion()};
  const Vector3<double> translations[] = {
      {0, 0, 0}, {0.3, 0, 0}, {0, 0, 0.4}, {0, -0.2, 0}, {0.1, 0.2, -0.3}};
  for (int k = 0; k < 12; ++k) {
    const int parent = k < 2 ? k - 1 : k - 1 - random.below(2);
    Joint<double> joint =
        placed(random, parent, rotations[random.below(6)], translations[random.below(5)]);
    if (random.chance(0.2)) {
      joint.coordinate = Coordinate::distance;
      joint.slides = true;
    }
    if (random.chance(0.3)) joint.r = 0.05;
    builder.add(joint);
  }
  return builder.build();
}

}  // namespace kalmarm::test
