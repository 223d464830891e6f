// Errors that grow from joint to joint are found, and where they do not grow nothing is suspected.
#include <gtest/gtest.h>

#include "algorithms/fast/instances.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

template <class T>
bool errors_grow(const Model<double>& drawn) {
  return RoundingGrowth<T>(drawn.cast<T>()).grows();
}

// a is right to 1 per cent, or the outcome says that it may not be. Counts what it says.
template <class T>
void expect_no_silent_error(const Model<double>& drawn, const State<double>& state, int& told) {
  const State<T> asked = state.cast<T>();
  Dynamics<T> robot = dynamics_of<T>(drawn, spatial({Want::acceleration}));
  VectorX<T> a = poisoned<T>(drawn.nv());
  const Outcome out = robot.forward_dynamics(asked.q, asked.qd, asked.tau, a);
  told += !out || out.warns();
  if (!out || out.warns()) return;
  EXPECT_LE(Truth(rounded<T>(drawn), asked.template cast<double>()).relative(a), 0.01);
}

TEST(RoundingGrowth, MassesThatGrowToTheTipAreNeverAnsweredWrongInSilence) {
  int told = 0;
  for (const double heaviest : {1e4, 1e6, 1e8, 1e10, 1e12, 1e14, 1e16})
    for (int seed = 0; seed < 10; ++seed) {
      SCOPED_TRACE("heaviest " + std::to_string(heaviest) + " seed " + std::to_string(seed));
      const Model<double> model = growing(seed, heaviest);
      expect_no_silent_error<float>(model, random_state(model, seed), told);
    }
  EXPECT_LE(told, 50) << "is there anything that it answers?";
}

TEST(RoundingGrowth, CentresOfMassNearTheBaseAreNeverAnsweredWrongInSilence) {
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

TEST(RoundingGrowth, GrowsWithTheMassAtTheTipAndInFloat32First) {
  for (int seed = 0; seed < 10; ++seed) {
    EXPECT_TRUE(errors_grow<float>(growing(seed, 1e12))) << seed;
    EXPECT_FALSE(errors_grow<float>(growing(seed, 10))) << seed;
    EXPECT_FALSE(errors_grow<double>(growing(seed, 1e6))) << seed;
  }
}

// Singular at home, and its sweep sees it: that says nothing of other positions.
TEST(RoundingGrowth, HomeMayBeSingular) {
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
  EXPECT_FALSE(errors_grow<double>(model));
  Dynamics<double> robot = dynamics_of<double>(model, spatial({Want::acceleration}));
  const VectorX<double> home = VectorX<double>::Zero(3), away = VectorX<double>::Constant(3, 0.8);
  VectorX<double> a(3);
  const VectorX<double> ones = VectorX<double>::Ones(3);
  EXPECT_FALSE(robot.forward_dynamics(home, ones, ones, a));
  EXPECT_TRUE(robot.forward_dynamics(away, ones, ones, a));
}

TEST(RoundingGrowth, WellMadeRobotsAreNotSuspected) {
  for (const Family& family : all_families()) {
    if (std::string(family.name) == "massless_links") continue;  // near gimbal lock at times
    for (int seed = 0; seed < 5; ++seed) {
      const Model<double> model = family.make(seed);
      EXPECT_FALSE(errors_grow<float>(model)) << family.name << " seed " << seed;
      EXPECT_FALSE(errors_grow<double>(model)) << family.name << " seed " << seed;
    }
  }
  for (const Model<double>& model : {chain(1, 1000), straight_chain(1000)}) {
    EXPECT_FALSE(errors_grow<float>(model));
    EXPECT_FALSE(errors_grow<double>(model));
  }
}

}  // namespace
}  // namespace kalmarm::test
