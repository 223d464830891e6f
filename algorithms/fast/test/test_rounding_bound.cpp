// The bound of what rounding does to D against multi-precision: never far below the error of a
// sweep, and not far above it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class RoundingBoundOf : public testing::Test {
 protected:
  // Of one position: the bound, and the largest relative error of a D of the sweep.
  struct Found {
    double bound, error;
    bool suspected;  // by the test of the sweep
  };

  Found find(const Model<double>& drawn, const VectorX<double>& position) {
    const LoweredModel<T> model(drawn.cast<T>());
    const VectorX<T> q = position.cast<T>();
    FastFactors<T> factors(model);
    covariance_factor(model, q.data(), factors);
    const VectorX<double> D = innovation_covariances(rounded<T>(drawn), q.template cast<double>());
    double error = 0;
    for (int k = 0; k < model.nv(); ++k) {
      const double own = std::abs(1 / (static_cast<double>(factors.links[k].inverse_D) * D[k]) - 1);
      if (!(own <= error)) error = own;
    }
    return {RoundingBound<T>(model).look(model, q.data()).bound, error, !(factors.margin > T(0))};
  }

  // It is below the bound; how far is kept. Above 1 per cent errors are no more of first order.
  void expect_bound(const Model<double>& drawn, const VectorX<double>& position) {
    const Found found = find(drawn, position);
    EXPECT_TRUE(found.suspected || found.error < 0.01) << found.error;
    if (!(found.bound < 0.01)) {
      ++refused_;
      return;
    }
    EXPECT_LE(found.error, found.bound);
    above_.push_back(found.bound / std::max(found.error, unit_roundoff<double>() / 8));
  }

  double median_above() {
    std::nth_element(above_.begin(), above_.begin() + above_.size() / 2, above_.end());
    return above_[above_.size() / 2];
  }

  std::vector<double> above_;
  int refused_ = 0;
};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(RoundingBoundOf, Precisions, PrecisionName);

TYPED_TEST(RoundingBoundOf, ErrorsOfAllFamiliesAreBelowItAndNear) {
  for (const Family& family : all_families())
    for (int seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE(std::string(family.name) + " seed " + std::to_string(seed));
      const Model<double> model = family.make(seed);
      this->expect_bound(model, random_state(model, seed).q);
    }
  EXPECT_EQ(this->refused_, 0);
  EXPECT_LE(this->median_above(), 35);
}

TYPED_TEST(RoundingBoundOf, ErrorsThatGrowFromJointToJointAreBelowIt) {
  for (const double heaviest : {1e2, 1e4, 1e6, 1e8, 1e10, 1e12, 1e14})
    for (int seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE("heaviest " + std::to_string(heaviest) + " seed " + std::to_string(seed));
      const Model<double> model = growing(seed, heaviest);
      this->expect_bound(model, random_state(model, seed).q);
    }
  EXPECT_LE(this->median_above(), 40);
  for (int n = 2; n <= 40; n += 2) {
    SCOPED_TRACE("com inboard, links " + std::to_string(n));
    this->expect_bound(com_inboard(n), VectorX<double>::Zero(n));
  }
  EXPECT_GE(this->refused_, 10);
  EXPECT_GE(this->above_.size(), 10);
}

TYPED_TEST(RoundingBoundOf, ErrorsOfWildMechanismsAreBelowIt) {
  for (int seed = 0; seed < 150; ++seed) {
    SCOPED_TRACE(seed);
    const Model<double> model = wild(seed);
    this->expect_bound(model, random_state(model, seed).q);
  }
  EXPECT_GE(this->above_.size(), 50);
  EXPECT_LE(this->median_above(), 40);
}

// A turn of a quarter puts the small moment of a heavy rod where the large one was: it carries the
// error of the large one, and what is light inboard has no other inertia.
TYPED_TEST(RoundingBoundOf, ErrorsOfTurnsByAQuarterAreBelowIt) {
  for (int seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto light = [&] {
      return point_mass(std::pow(10, random.uniform(-8, -4)), random.vector3());
    };
    Builder builder;
    Joint<double> joint;
    for (int k = 0; k < 3; ++k) {
      joint = random_joint(random, k - 1);
      joint.r = 0;
      joint.body = light();
      if (k == 1) joint.translation.setZero();
      if (k == 2) joint.translation = {0, 0, random.uniform(-4, 4)};
      if (k == 2) joint.body = point_mass(random.uniform(1, 100), {random.uniform(0.5, 2), 0, 0});
      if (k == 2) joint.rotation = {1, random.uniform(-2, 2), 0, 0};
      builder.add(joint);
    }
    VectorX<double> q = VectorX<double>::Zero(3);
    q[0] = random.uniform(-3, 3);
    q[2] = 2 * std::atan(1.0) * (1 + 2 * random.below(2)) + random.uniform(-1e-3, 1e-3);
    this->expect_bound(builder.build(), q);
  }
}

// A body far along the axis of a hinge that stands as far away, so that it ends near the first axis:
// translations that cancel leave the rounding of a long lever in an inertia of a short one.
TYPED_TEST(RoundingBoundOf, ErrorsOfTranslationsThatCancelAreBelowIt) {
  for (int seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto decades = [&](double low, double high) {
      return std::pow(10, random.uniform(low, high));
    };
    const auto light = [&] { return point_mass(decades(-8, -2), 0.1 * random.vector3()); };
    const double away = random.uniform(5, 20), tilt = random.uniform(0.2, 1.2);
    Builder builder;
    Joint<double> joint;
    joint.body = light();
    joint.parent = builder.add(joint);
    joint.rotation = {std::cos(tilt / 2), -std::sin(tilt / 2), 0, 0};
    joint.translation = {0, away * std::sin(tilt) + decades(-2, 0), 0};
    joint.body = light();
    joint.parent = builder.add(joint);
    joint.rotation = {1, 1e-3 * random.uniform(0.1, 1), 0, 0};
    joint.translation = {0, 0, -away};
    joint.body = point_mass(decades(2, 5), 0.01 * random.vector3());
    builder.add(joint);
    const Model<double> model = builder.build();
    this->expect_bound(model, random_state(model, seed).q);
  }
}

// Long chains in which nothing is lost: D is known to all digits, and it says so.
TYPED_TEST(RoundingBoundOf, IsAFewRoundingsOnLongChains) {
  const double u = static_cast<double>(unit_roundoff<TypeParam>());
  for (const int links : {63, 255, 1000})
    for (const Model<double>& drawn : {straight_chain(links), chain(1, links)}) {
      const LoweredModel<TypeParam> model(drawn.template cast<TypeParam>());
      VectorX<TypeParam> q = VectorX<TypeParam>::Zero(links);
      const RoundingLoss straight = RoundingBound<TypeParam>(model).look(model, q.data());
      EXPECT_LE(straight.bound, 2000 * u) << links;
    }
}

// So they cost a sweep and no more.
TYPED_TEST(RoundingBoundOf, LongChainsAndTreesAreNoSuspects) {
  const auto big_tree = [](int links) {
    Random random(2);
    Builder builder;
    for (int k = 0; k < links; ++k)
      builder.add(random_joint(random, k == 0 ? -1 : std::max(0, k - 1 - random.below(3))));
    return builder.build();
  };
  const bool is_float = std::is_same_v<TypeParam, float>;
  for (const int links : is_float ? std::vector<int>{31, 127} : std::vector<int>{63, 255, 1000})
    for (const Model<double>& drawn : {straight_chain(links), chain(1, links), big_tree(links)}) {
      const LoweredModel<TypeParam> model(drawn.template cast<TypeParam>());
      FastFactors<TypeParam> factors(model);
      for (const bool straight : {true, false}) {
        VectorX<TypeParam> q = random_state(drawn, links).q.template cast<TypeParam>();
        if (straight) q.setZero();
        covariance_factor(model, q.data(), factors);
        EXPECT_GT(factors.margin, 0) << links << (straight ? " straight" : " bent");
      }
    }
}

// Two axes in line, and no mass between: no D is known, and the joint is named.
TYPED_TEST(RoundingBoundOf, NamesTheJointThatIsSingular) {
  Random random(3);
  Builder builder;
  Joint<double> joint = random_joint(random, builder.add(random_joint(random, -1)));
  joint.parent = builder.add_massless(joint);
  joint.rotation = {1, 0, 0, 0};
  joint.translation.setZero();
  builder.add(joint);
  const LoweredModel<TypeParam> model(builder.build().cast<TypeParam>());
  const VectorX<TypeParam> q = VectorX<TypeParam>::Zero(3);
  const RoundingLoss loss = RoundingBound<TypeParam>(model).look(model, q.data());
  EXPECT_GE(loss.bound, 0.01);
  EXPECT_EQ(loss.joint, 1);
}

}  // namespace
}  // namespace kalmarm::test
