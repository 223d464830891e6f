// Friction that a fit was not told of, or was told of and is not there, shows in what is left.
#include <gtest/gtest.h>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "accuracy/fits/excitation.hpp"
#include "accuracy/fits/friction_left.hpp"
#include "accuracy/fits/prediction.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm {
namespace {

const Model<double> model = random_chain(3, 1, 1);

Mechanics<double> robot(double viscous, double coulomb) {
  return {model, VectorX<double>::Constant(3, viscous), VectorX<double>::Constant(3, coulomb)};
}

Samples moved(const Mechanics<double>& truth) {
  ExcitationOptions options;
  options.count = 200;
  options.candidates = 1;
  Samples out = excite(generated_scene("chain", truth.model), options).samples;
  out.tau = torques(truth, out);
  return out;
}

const std::vector<int> all = {0, 1, 2}, none;

TEST(FrictionLeft, IsMissingWhereTheDataHaveMore) {
  for (const auto& truth : {robot(5, 0), robot(0, 5), robot(3, 3)}) {
    const FrictionLeft left = friction_left(robot(0, 0), moved(truth));
    EXPECT_EQ(left.missing, all);
    EXPECT_EQ(left.excessive, none);
  }
}

TEST(FrictionLeft, IsExcessiveWhereTheRobotHasMore) {
  for (const auto& told : {robot(5, 0), robot(0, 5), robot(3, 3)}) {
    const FrictionLeft left = friction_left(told, moved(robot(0, 0)));
    EXPECT_EQ(left.missing, none);
    EXPECT_EQ(left.excessive, all);
  }
}

TEST(FrictionLeft, IsNoneWhereTheRobotIsRightOrOffInOtherWays) {
  Samples right = moved(robot(1, 1));
  const auto expect_none = [](const FrictionLeft& left) {
    EXPECT_EQ(left.missing, none);
    EXPECT_EQ(left.excessive, none);
  };
  expect_none(friction_left(robot(1, 1), right));
  boost::random::mt19937_64 random(1);
  boost::random::normal_distribution<double> normal;
  for (double& tau : right.tau.reshaped()) tau += normal(random);
  expect_none(friction_left(robot(1, 1), right));
  Mechanics<double> heavy = robot(1, 1);
  heavy.model = random_chain(3, 1, 3);
  expect_none(friction_left(heavy, right));
}

}  // namespace
}  // namespace kalmarm
