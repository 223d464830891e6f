#include <gtest/gtest.h>

#include <cmath>

#include "accuracy/recommend.hpp"
#include "robots/families.hpp"
#include "robots/generate.hpp"
#include "robots/input_error.hpp"

namespace kalmarm {
namespace {

const Vector3<double> down(0, 0, -9.81);

Model<double> heavy_tip(double ratio) {
  const Model<double> chain = random_chain(8, 3, 1);
  std::vector<Joint<double>> joints;
  for (int k = 0; k < chain.nv(); ++k) joints.push_back(chain.joint(k));
  joints.back().body.mass *= ratio;
  joints.back().body.moments *= ratio;
  return {std::move(joints), chain.names(), chain.nq(), down};
}

// Bent by `angle` everywhere, at rest, every torque 1.
Loss loss_of(const Model<double>& model, double angle) {
  const int n = model.nv();
  LossPredictor predict(model, true);
  return predict(VectorX<double>::Constant(model.nq(), angle),
                 {VectorX<double>::Ones(n), VectorX<double>::Zero(n)});
}

constexpr Request acceleration(double tolerance) { return {.tolerance = tolerance}; }

constexpr Request inverse(double tolerance) {
  return {.acceleration = false, .inverse = true, .tolerance = tolerance};
}

void expect_choice(const Choice& choice, const char* variant, const char* precision) {
  EXPECT_EQ(choice.variant, variant) << choice.predicted;
  EXPECT_EQ(choice.precision, precision) << choice.predicted;
}

TEST(Recommend, RobotLikeChainTakesThePlainFormAndFloat32WhereItIsEnough) {
  const Loss loss = loss_of(random_chain(7, 1, 1), 0.5);
  expect_choice(recommend(loss, acceleration(1e-4)), "Sequential<Conventional>", "float32");
  expect_choice(recommend(loss, acceleration(1e-9)), "Sequential<Conventional>", "float64");
  expect_choice(recommend(loss, inverse(1e-9)), "Batch<SparseLTDL>", "float64");
}

TEST(Recommend, PrecisionIsKeptWhereItIsGiven) {
  Request request = acceleration(1e-4);
  request.precision = "float64";
  expect_choice(recommend(loss_of(random_chain(7, 1, 1), 0.5), request), "Sequential<Conventional>",
                "float64");
  request = acceleration(1e-2);
  request.precision = "float32";
  expect_choice(recommend(loss_of(heavy_tip(1e10), 0.5), request), recommended_variant, "float32");
}

TEST(Recommend, HeavyTipTakesASquareRoot) {
  const Loss loss = loss_of(heavy_tip(1e10), 0.5);
  EXPECT_GT(loss.cancellation, 1e8);
  EXPECT_LT(loss.parameters, 1e4);
  const Choice choice = recommend(loss, acceleration(1e-7));
  expect_choice(choice, recommended_variant, "float64");
  EXPECT_LE(choice.predicted, 1e-7);
}

TEST(Recommend, StretchedChainDoesNotTakeCholesky) {
  const Loss loss = loss_of(auto_tree(127, 1, 0, Vector3<double>::Zero()), 0);
  EXPECT_GT(loss.cholesky, 1e8);
  EXPECT_LT(loss.cancellation, 1e3);
  expect_choice(recommend(loss, inverse(1e-10)), "Sequential<Conventional>", "float64");
}

// One state is stretched out far enough to need another variant.
TEST(Recommend, TheWorstStateDecides) {
  Loss loss;
  loss.worsen({.cancellation = 1e3, .parameters = 1, .observed = 20, .cholesky = 1});
  loss.worsen({.cancellation = 2, .parameters = 1e9, .observed = std::nan(""), .cholesky = 4});
  EXPECT_EQ(loss.cancellation, 1e3);
  EXPECT_EQ(loss.parameters, 1e9);
  EXPECT_EQ(loss.observed, HUGE_VAL);
  EXPECT_EQ(loss.cholesky, 4);
}

TEST(Recommend, SingularMechanismLeavesNothing) {
  const Loss loss = loss_of(heavy_tip(0), 0.5);
  EXPECT_EQ(loss.cancellation, HUGE_VAL);
  const Choice choice = recommend(loss, acceleration(1e-2));
  EXPECT_EQ(choice.variant, recommended_variant);
  EXPECT_GT(choice.predicted, 1e-2);
}

TEST(Recommend, ToleranceBelowTheRoundoffIsRefused) {
  const Loss loss = loss_of(random_chain(7, 1, 1), 0.5);
  try {
    recommend(loss, acceleration(1e-18));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("of float64"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace kalmarm
