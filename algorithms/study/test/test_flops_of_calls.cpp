// The flops that a plan says a call takes, against what the kernels' headers promise and against one
// another.
#include <gtest/gtest.h>

#include <string>

#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/spatial/pack.hpp"
#include "algorithms/study/flops/flops.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

constexpr CallKind single = {}, rows = {.rows = true};

double flops_of_form(const Model<double>& model, Want want, CallKind call = single) {
  return flops_of(model, want, {}, call);
}

void expect_about(double flops, double promised, const std::string& what) {
  EXPECT_NEAR(flops, promised, 0.25 * promised) << what;
}

TEST(FlopsOfACall, AreAboutWhatHeadersPromise) {
  for (const double n : {7., 20., 31.}) {
    const Model<double> model = chain(3, static_cast<int>(n));
    const std::string size = " of " + std::to_string(n);
    expect_about(flops_of_form(model, Want::inverse_dynamics), 171 * n, "torques" + size);
    expect_about(flops_of_form(model, Want::mass, rows), 80 * n + 13 * n * n, "M" + size);
    expect_about(flops_of_form(model, Want::inverse, rows), 195 * n + 43 * n * n, "M^-1" + size);
    expect_about(flops_of_form(model, Want::solve), (195 + 127) * n, "M^-1 tau" + size);
  }
}

TEST(FlopsOfACall, AnInverseOfOneHingeIsAReciprocal) {
  const Model<double> model = chain(3, 1);
  const double factors = flops_of_form(model, Want::solve) - 127;
  const double after = flops_of_form(model, Want::inverse) - factors;
  EXPECT_GE(after, 1);
  EXPECT_LE(after, 43);
}

// Zero blocks cost nothing.
TEST(FlopsOfACall, OfMatricesOfTwoTreesAddUp) {
  Random random(7);
  Builder one, other, both;
  for (int k = 0; k < 5; ++k) {
    Joint<double> joint = random_joint(random, k - 1);
    one.add(joint);
    both.add(joint);
  }
  for (int k = 0; k < 4; ++k) {
    Joint<double> joint = random_joint(random, k - 1);
    other.add(joint);
    joint.parent = k == 0 ? -1 : 5 + k - 1;
    both.add(joint);
  }
  const Model<double> first = one.build(), second = other.build(), forest = both.build();
  for (const Want want : {Want::mass, Want::inverse, Want::solve, Want::derivatives})
    EXPECT_EQ(flops_of_form(forest, want), flops_of_form(first, want) + flops_of_form(second, want))
        << to_string(want);
}

// Blocks depend on registers; in rows a lane is a state.
TEST(FlopsOfACall, LongChainsGoByBlocksWhereTheirKernelsDo) {
  constexpr int lanes = Lanes<TwoPacks<double>>::count;
  const int n = 4 * lanes;
  const double nv = n, blocks = 1500 * nv + 8 * nv * nv;
  EXPECT_EQ(flops_of_form(chain(3, n), Want::mass), blocks);
  EXPECT_LT(flops_of_form(chain(3, n - 1), Want::mass), 0.9 * blocks);
  ASSERT_LE(n, most_rows_in_lanes);
  EXPECT_LT(flops_of_form(chain(3, n), Want::mass, rows), 0.9 * blocks);
}

TEST(FlopsOfACall, OfManyLinksAreTheSameInRows) {
  const Model<double> model = chain(3, most_rows_in_lanes + 1);
  for (const Want want : {Want::mass, Want::inverse})
    EXPECT_EQ(flops_of_form(model, want, rows), flops_of_form(model, want)) << to_string(want);
}

}  // namespace
}  // namespace kalmarm::test
