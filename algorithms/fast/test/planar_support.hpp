// Planar and translational mechanisms for the tests: placed at any tilt, with axes that are
// parallel but for the rounding of their quaternions.
#pragma once

#include <numbers>
#include <vector>

#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {

enum class Moves { turns, slides_across, slides_along };  // the normal of the plane

class PlanarBuilder {
 public:
  explicit PlanarBuilder(std::uint64_t seed)
      : random_(seed), base_(random_.quaternion().normalized().toRotationMatrix()) {}

  Random& random() { return random_; }

  // A joint whose axis is the normal, its opposite or, of slides across it, in the plane.
  Joint<double> joint(int parent, Moves moves) {
    using std::numbers::pi;
    const auto about = [](double angle, const Vector3<double>& axis) {
      return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    };
    const Vector3<double> x = Vector3<double>::UnitX(), z = Vector3<double>::UnitZ();
    placed_ = about(random_.uniform(-pi, pi), z);
    if (moves == Moves::slides_across)
      placed_ = placed_ * about(pi / 2, x) * about(random_.uniform(-pi, pi), z);
    else if (random_.chance(0.3))
      placed_ = placed_ * about(pi, x);
    Joint<double> joint = random_joint(
        random_, parent, moves == Moves::turns ? Coordinate::angle : Coordinate::distance);
    const Matrix3<double> inboard = parent < 0 ? Matrix3<double>(base_.transpose()) : home_[parent];
    joint.rotation = Eigen::Quaterniond(Matrix3<double>(inboard.transpose() * placed_));
    joint.rotation.coeffs() *= random_.uniform(0.5, 2);
    return joint;
  }

  // The joint that was drawn last, or that with other numbers.
  int add(const Joint<double>& joint) {
    home_.push_back(placed_);
    return builder_.add(joint);
  }

  int add(int parent, Moves moves) { return add(joint(parent, moves)); }

  Model<double> build() const { return builder_.build(); }

 private:
  Random random_;
  Builder builder_;
  Matrix3<double> base_, placed_;      // the plane's axes in the world's; a link's in the plane's
  std::vector<Matrix3<double>> home_;  // at q = ref
};

inline Model<double> planar_chain(std::uint64_t seed, int n = 10) {
  PlanarBuilder builder(seed);
  for (int k = 0; k < n; ++k) builder.add(k - 1, Moves::turns);
  return builder.build();
}

inline Model<double> planar_tree(std::uint64_t seed) {
  PlanarBuilder builder(seed);
  for (int k = 0; k < 16; ++k) builder.add(k == 0 ? -1 : builder.random().below(k), Moves::turns);
  return builder.build();
}

// Anything that stays in the plane or slides along its normal: branches, several trees, armature.
inline Model<double> planar_everything(std::uint64_t seed) {
  PlanarBuilder builder(seed);
  for (int k = 0; k < 20; ++k) {
    Random& random = builder.random();
    const int parent = random.chance(0.15) ? -1 : std::max(-1, k - 1 - random.below(3));
    const double kind = random.uniform(0, 1);
    Joint<double> joint = builder.joint(parent, kind < 0.5   ? Moves::turns
                                                : kind < 0.8 ? Moves::slides_across
                                                             : Moves::slides_along);
    if (random.chance(0.3)) joint.r = random.uniform(0.01, 0.5);
    builder.add(joint);
  }
  return builder.build();
}

inline Model<double> with_joint(const Model<double>& model, int k, const Joint<double>& joint) {
  std::vector<Joint<double>> joints;
  for (int i = 0; i < model.nv(); ++i) joints.push_back(i == k ? joint : model.joint(i));
  return {joints, model.names(), model.nq(), model.gravity()};
}

// Slides in any direction on several trees, some with armature.
inline Model<double> slides_alone(std::uint64_t seed, int n) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < n; ++k) {
    Joint<double> joint =
        random_joint(random, random.chance(0.2) ? -1 : std::max(-1, k - 1 - random.below(2)),
                     Coordinate::distance);
    if (random.chance(0.3)) joint.r = random.uniform(0.01, 0.5);
    builder.add(joint);
  }
  return builder.build();
}

inline std::vector<Family> translational_families() {
  return {{"one_slide", [](std::uint64_t seed) { return slides_alone(seed, 1); }},
          {"gantry", [](std::uint64_t seed) { return slides_alone(seed, 3); }},
          {"six_slides", [](std::uint64_t seed) { return slides_alone(seed, 6); }},
          {"seven_slides", [](std::uint64_t seed) { return slides_alone(seed, 7); }},
          {"many_slides", [](std::uint64_t seed) { return slides_alone(seed, 25); }}};
}

}  // namespace kalmarm::test
