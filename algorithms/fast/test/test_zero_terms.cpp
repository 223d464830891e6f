// Links whose axes are parallel, at a right angle or meet: counted, and left out without a change
// of any result.
#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "algorithms/dynamics/plan.hpp"
#include "algorithms/fast/lowering/zero_terms.hpp"
#include "algorithms/fast/test/zero_terms_support.hpp"

namespace kalmarm::test {
namespace {

void expect_count(const Model<double>& model, const ZeroTerms& right) {
  const ZeroTerms got = count_zero_terms(LoweredModel<double>(model));
  EXPECT_EQ(got.links, right.links);
  EXPECT_EQ(got.parallel, right.parallel);
  EXPECT_EQ(got.right_angles, right.right_angles);
  EXPECT_EQ(got.meeting, right.meeting);
  EXPECT_EQ(got.without_offset, right.without_offset);
}

TEST(ZeroTerms, AreCountedOnMechanismsMadeByHand) {
  {
    SCOPED_TRACE("wrist");
    expect_count(chain_of(right, {0, 0, 0}, 3), {2, 0, 2, 2, 2});
  }
  {
    SCOPED_TRACE("plane");
    expect_count(chain_of(same, {0.5, 0, 0}, 4), {3, 3, 0, 0, 3});
  }
  {
    SCOPED_TRACE("one line");
    expect_count(chain_of(same, {0, 0, 0.5}, 4), {3, 3, 0, 3, 0});
  }
  {
    SCOPED_TRACE("right angles, common perpendiculars");
    expect_count(chain_of(right, {0.5, 0, 0}, 4), {3, 0, 3, 0, 3});
  }
  {
    SCOPED_TRACE("random");
    expect_count(chain(4, 6), {5, 0, 0, 0, 0});
  }
  {
    SCOPED_TRACE("nearly a right angle");
    expect_count(chain_of({1, 1 + 1e-12, 0, 0}, {0.5, 0, 0}, 3), {2, 0, 0, 0, 2});
  }
  {
    SCOPED_TRACE("nearly parallel");  // the cosine is 1, the sine is not 0
    expect_count(chain_of({1, 1e-13, 0, 0}, {0.5, 0, 0}, 3), {2, 0, 0, 0, 2});
  }
  {
    SCOPED_TRACE("antiparallel");
    expect_count(chain_of({0, 1, 0, 0}, {0.5, 0, 0}, 3), {2, 0, 0, 0, 2});
  }
  {
    SCOPED_TRACE("a free joint has none");
    Random random(1);
    Builder builder;
    builder.add_free(random_joint(random, -1));
    expect_count(builder.build(), {0, 0, 0, 0, 0});
  }
}

// Also in lanes, whose code is another.
TEST(ZeroTerms, EveryResultHasItsDigits) {
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Model<double> model = like_a_robot(seed);
    const int nv = model.nv();
    const State<double> state = random_state(model, seed);
    const Truth truth(model, state);
    const MatrixX<double> M = truth.M();
    const std::set<Want> want{Want::acceleration, Want::inverse, Want::mass,
                              Want::inverse_dynamics};
    Dynamics<double> robot = dynamics_of<double>(model, spatial(want));
    VectorX<double> a = poisoned<double>(nv), tau = a;
    ASSERT_TRUE(robot.forward_dynamics(state.q, state.qd, state.tau, a));
    EXPECT_LE(truth.acceleration(a), 1e-14);
    std::vector<Outcome> outcomes(2);
    VectorX<double> rows = poisoned<double>(2 * nv);
    EXPECT_EQ(
        robot.forward_dynamics(twice(state.q), twice(state.qd), twice(state.tau), rows, outcomes),
        0);
    EXPECT_LE(truth.acceleration(VectorX<double>(rows.tail(nv))), 1e-14);
    MatrixX<double> X = poisoned<double>(nv, nv);
    ASSERT_TRUE(robot.inverse_mass(state.q, X));
    EXPECT_LE((X * M - MatrixX<double>::Identity(nv, nv)).norm(), 1e-9);
    robot.mass(state.q, X);
    EXPECT_LE((X - M).norm(), 1e-14 * M.norm());
    robot.inverse_dynamics(state.q, state.qd, state.tau, tau);
    EXPECT_LE(truth.torque(tau), 1e-14);
  }
}

// With the rule and without it the numbers are the same but for rounding, and the rule is said to
// have acted where it may.
TEST(ZeroTerms, MayBeKept) {
  int acted = 0;
  for (int seed = 0; seed < 20; ++seed) {
    const Model<double> model = like_a_robot(seed);
    const State<double> state = random_state(model, seed);
    DynamicsOptions options = spatial({Want::acceleration});
    Dynamics<double> with = dynamics_of<double>(model, options);
    options.rules.erase(Rule::zero_terms);
    Dynamics<double> without = dynamics_of<double>(model, options);
    VectorX<double> a = poisoned<double>(model.nv()), b = a;
    ASSERT_TRUE(with.forward_dynamics(state.q, state.qd, state.tau, a));
    ASSERT_TRUE(without.forward_dynamics(state.q, state.qd, state.tau, b));
    const Truth truth(model, state);
    EXPECT_LE(truth.acceleration(a), 1e-14) << seed;
    EXPECT_LE(truth.acceleration(b), 1e-14) << seed;
    EXPECT_TRUE(without.plan().acted.empty());
    acted += !with.plan().acted.empty();
  }
  EXPECT_GE(acted, 15);
}

}  // namespace
}  // namespace kalmarm::test
