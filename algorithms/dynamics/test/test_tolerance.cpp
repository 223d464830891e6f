// A tolerance decides which precision answers, and is kept: against truth in 50 digits.
#include <gtest/gtest.h>

#include <algorithm>
#include <type_traits>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

using Rung = Outcome::Rung;

template <class T>
class ToleranceOf : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(ToleranceOf, Precisions, PrecisionName);

template <class T>
Rung rung_of_row(const Model<double>& model, const DynamicsOptions& options) {
  Dynamics<T> robot = dynamics_of<T>(model, options);
  Rows<T> rows(model, 3);
  EXPECT_EQ(rows.forward_dynamics(robot), 0);
  return rows.outcomes[1].rung;
}

template <class T>
Rung rung_of_state(const Model<double>& model, const DynamicsOptions& options) {
  Dynamics<T> robot = dynamics_of<T>(model, options);
  const State<T> state = random_state(model, 1).cast<T>();
  VectorX<T> a = poisoned<T>(model.nv());
  const Outcome out = robot.forward_dynamics(state.q, state.qd, state.tau, a);
  EXPECT_TRUE(out && !out.warns());
  return out.rung;
}

TEST(Tolerance, OrdinaryRobotsAreAnsweredByTheFirstRungThatIsTried) {
  const Model<double> model = tree(3);
  EXPECT_EQ(rung_of_row<float>(model, {}), Rung::float_lanes);
  EXPECT_EQ(rung_of_row<float>(model, {.tolerance = 1e-6}), Rung::float64);
  EXPECT_EQ(rung_of_state<float>(model, {}), Rung::float64);
  EXPECT_EQ(rung_of_row<double>(model, {}), Rung::float64);
  EXPECT_EQ(rung_of_state<double>(model, {}), Rung::float64);
  EXPECT_EQ(rung_of_state<double>(model, {.tolerance = 1e-10}), Rung::float64);
  for (const double tolerance : {1e-14, last_bits}) {
    EXPECT_EQ(rung_of_row<double>(model, {.tolerance = tolerance}), Rung::refined);
    EXPECT_EQ(rung_of_state<double>(model, {.tolerance = tolerance}), Rung::refined);
    EXPECT_EQ(rung_of_state<float>(model, {.tolerance = tolerance}), Rung::refined);
  }
}

TEST(Tolerance, IsThatOfThePrecisionUnlessTold) {
  EXPECT_EQ(dynamics_of<float>(tree(3), {}).tolerance(), default_tolerance<float>);
  EXPECT_EQ(dynamics_of<double>(tree(3), {}).tolerance(), default_tolerance<double>);
  EXPECT_EQ(dynamics_of<double>(tree(3), {.tolerance = 0.5}).tolerance(), 0.5);
}

// Masses over twelve decades, of which two rungs answer some: without a warning |da| is within the
// tolerance and the rounding of the answer to T.
TYPED_TEST(ToleranceOf, WildMechanismsIsKept) {
  using T = TypeParam;
  std::vector<int> answered(4, 0);
  for (const double tolerance : {1e-2, 1e-5, 1e-8, 1e-10, 1e-12, last_bits}) {
    for (int seed = 0; seed < 60; ++seed) {
      const Model<double> model = rounded<T>(wild(seed));
      const State<T> state = random_state(model, seed).template cast<T>();
      Dynamics<T> robot = dynamics_of<T>(model, {.tolerance = tolerance});
      VectorX<T> a = poisoned<T>(model.nv());
      std::vector<Outcome> outcomes(2);
      VectorX<T> rows = poisoned<T>(2 * model.nv());
      if (robot.forward_dynamics(twice(state.q), twice(state.qd), twice(state.tau), rows,
                                 outcomes) > 0)
        continue;
      a = rows.head(model.nv());
      if (outcomes[0].warns()) continue;
      ++answered[static_cast<int>(outcomes[0].rung)];
      const double size = a.template cast<double>().norm();
      const double error = Truth(model, state.template cast<double>()).relative(a) * size;
      const double scale = std::max(size, 0.01 * model.gravity().norm());
      EXPECT_LE(error,
                std::max(tolerance, 2 * outcomes[0].error) * scale + 2 * unit_roundoff<T>() * size)
          << seed << " within " << tolerance << " by " << to_string(outcomes[0].rung);
      // What a refined answer says is above its share of the tolerance climbs; to T it is rounded after.
      if (outcomes[0].rung == Rung::refined) {
        EXPECT_LE(outcomes[0].error, std::max(tolerance / 12, last_bits) +
                                         (std::is_same_v<T, float> ? unit_roundoff<T>() : 0));
      }
    }
  }
  EXPECT_GE(answered[static_cast<int>(Rung::float64)], 5);
  EXPECT_GE(answered[static_cast<int>(Rung::refined)], 5);
}

}  // namespace
}  // namespace kalmarm::test
