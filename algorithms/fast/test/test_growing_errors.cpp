// Errors that grow from joint to joint, each of which looks well, are found.
#include <gtest/gtest.h>

#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

// a is right to 1 per cent, or the outcome says that it may not be. Counts what it says.
template <class T>
void expect_no_silent_error(const Model<double>& drawn, const State<double>& state, int& told,
                            const DynamicsOptions& options = spatial({Want::acceleration})) {
  const State<T> asked = state.cast<T>();
  Dynamics<T> robot = dynamics_of<T>(drawn, options);
  VectorX<T> a = poisoned<T>(drawn.nv());
  const Outcome out = robot.forward_dynamics(asked.q, asked.qd, asked.tau, a);
  told += !out || out.warns();
  if (!out || out.warns()) return;
  EXPECT_LE(Truth(rounded<T>(drawn), asked.template cast<double>()).relative(a), 0.01);
}

TEST(GrowingErrors, MassesThatGrowToTheTipAreNeverAnsweredWrongInSilence) {
  int told = 0;
  for (const double heaviest : {1e4, 1e6, 1e8, 1e10, 1e12, 1e14, 1e16})
    for (int seed = 0; seed < 10; ++seed) {
      SCOPED_TRACE("heaviest " + std::to_string(heaviest) + " seed " + std::to_string(seed));
      const Model<double> model = growing(seed, heaviest);
      expect_no_silent_error<float>(model, random_state(model, seed), told);
    }
  EXPECT_LE(told, 50) << "is there anything that it answers?";
}

TEST(GrowingErrors, CentresOfMassNearTheBaseAreNeverAnsweredWrongInSilence) {
  int told32 = 0, told64 = 0;
  for (int n = 4; n <= 64; ++n) {
    SCOPED_TRACE(n);
    const Model<double> model = com_inboard(n);
    State<double> state = random_state(model, n);
    state.q.setZero();
    expect_no_silent_error<float>(model, state, told32);
    expect_no_silent_error<double>(model, state, told64);
  }
  EXPECT_LE(told32, 46) << "is there anything that it answers?";
  EXPECT_LE(told64, 46);
}

// Singular at home, and its sweep sees it: that says nothing of other positions.
TEST(GrowingErrors, HomeMayBeSingular) {
  Random random(4);
  Builder builder;
  Joint<double> joint = random_joint(random, -1);
  joint.ref = 0;
  joint.translation.setZero();
  int k = -1;
  for (const double x : {0, 1, -1}) {  // quarter turns about x: a wrist
    joint.parent = k;
    joint.rotation = {1, x, 0, 0};
    k = k < 1 ? builder.add_massless(joint) : builder.add(joint);
  }
  const Model<double> model = builder.build();
  Dynamics<double> robot = dynamics_of<double>(model, spatial({Want::acceleration}));
  const VectorX<double> home = VectorX<double>::Zero(3), away = VectorX<double>::Constant(3, 0.8);
  VectorX<double> a(3);
  const VectorX<double> ones = VectorX<double>::Ones(3);
  EXPECT_FALSE(robot.forward_dynamics(home, ones, ones, a));
  EXPECT_TRUE(robot.forward_dynamics(away, ones, ones, a));
}

}  // namespace
}  // namespace kalmarm::test
