// Which mechanisms are planar.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "algorithms/fast/planar/plane.hpp"
#include "algorithms/fast/planar/translational.hpp"
#include "algorithms/fast/test/planar_support.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class FoundPlanes : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(FoundPlanes, Precisions, PrecisionName);

TYPED_TEST(FoundPlanes, FamiliesAreFoundPlanar) {
  for (const Family& family : planar_families())
    for (int seed = 0; seed < 50; ++seed)
      EXPECT_TRUE(find_plane(family.make(seed).template cast<TypeParam>()))
          << family.name << " seed " << seed;
}

// Joint k's placement turned about its x axis.
Model<double> tilted(const Model<double>& model, int k, double angle) {
  Joint<double> joint = model.joint(k);
  joint.rotation = joint.rotation * Eigen::Quaterniond(1, angle / 2, 0, 0);
  return with_joint(model, k, joint);
}

TYPED_TEST(FoundPlanes, TiltOfTwoMillionthsIsRefused) {
  for (int k = 1; k < 10; ++k)
    EXPECT_FALSE(find_plane(tilted(planar_chain(3), k, 2e-6).cast<TypeParam>())) << k;
  EXPECT_TRUE(find_plane(tilted(planar_chain(3), 0, 2e-6).cast<TypeParam>()));  // another plane
  for (int k = 1; k < 16; ++k)
    EXPECT_FALSE(find_plane(tilted(planar_tree(3), k, 2e-6).cast<TypeParam>())) << k;
}

TYPED_TEST(FoundPlanes, ObliqueSlideIsRefused) {
  for (int seed = 0; seed < 5; ++seed) {
    PlanarBuilder builder(seed);
    builder.add(-1, Moves::turns);
    Joint<double> slide = builder.joint(0, Moves::slides_along);
    slide.rotation = slide.rotation * Eigen::Quaterniond(std::cos(std::numbers::pi / 8),
                                                         std::sin(std::numbers::pi / 8), 0, 0);
    builder.add(slide);
    EXPECT_FALSE(find_plane(builder.build().cast<TypeParam>()));
  }
}

TYPED_TEST(FoundPlanes, BallAndFreeJointsAreRefused) {
  Random random(2);
  Builder ball, free;
  ball.add_ball(random_joint(random, -1));
  free.add_free(random_joint(random, -1));
  EXPECT_FALSE(find_plane(ball.build().cast<TypeParam>()));
  EXPECT_FALSE(find_plane(free.build().cast<TypeParam>()));
  EXPECT_FALSE(is_translational(free.build().cast<TypeParam>()));
  EXPECT_FALSE(is_translational(planar_chain(1).cast<TypeParam>()));
  EXPECT_TRUE(is_translational(slides_alone(1, 4).cast<TypeParam>()));
}

TYPED_TEST(FoundPlanes, SlidesAloneArePlanarWhereTwoOfThreeAxesAreAcross) {
  EXPECT_FALSE(find_plane(slides_alone(1, 12).cast<TypeParam>()));  // any directions
  Builder gantry;                                                   // x, y, z
  Random random(3);
  for (int k = 0; k < 3; ++k) {
    Joint<double> joint = random_joint(random, k - 1, Coordinate::distance);
    joint.rotation = {1, 1, 1, 1};
    gantry.add(joint);
  }
  EXPECT_TRUE(find_plane(gantry.build().cast<TypeParam>()));
}

}  // namespace
}  // namespace kalmarm::test
