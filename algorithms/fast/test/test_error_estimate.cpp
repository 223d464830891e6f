// What an acceleration says of its own error, against multi-precision: in the energy norm, of one state in
// double and of rows in lanes of float, on robots as they are made and on those that lose digits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/planar_support.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class ErrorEstimateOf : public testing::Test {
 protected:
  // A state of a robot, of float in a row: keeps Outcome::error over the true error, which is counted as one
  // roundoff where it is less. What another rung answers is left out.
  void look(const Model<double>& drawn, const State<double>& given,
            const DynamicsOptions& options = spatial({Want::acceleration})) {
    const State<T> state = given.template cast<T>();
    Dynamics<T> robot = dynamics_of<T>(drawn, options);
    VectorX<T> a = poisoned<T>(drawn.nv());
    Outcome out;
    if constexpr (std::is_same_v<T, float>) {
      // Twice, since one row would be one state.
      std::vector<Outcome> outcomes(2);
      VectorX<T> rows = poisoned<T>(2 * drawn.nv());
      const int failed =
          robot.forward_dynamics(twice(state.q), twice(state.qd), twice(state.tau), rows, outcomes);
      ASSERT_EQ(failed, 2 * !outcomes[0]);
      out = outcomes[0];
      a = rows.head(drawn.nv());
    } else {
      out = robot.forward_dynamics(state.q, state.qd, state.tau, a);
    }
    if (!out || out.rung > answered_in_lanes<T>().rung) return;
    const Truth truth(rounded<T>(drawn), state.template cast<double>());
    const double u = static_cast<double>(unit_roundoff<T>());
    EXPECT_GT(out.error, 0);
    ratios_.push_back(out.error / std::max(truth.energy(a), u));
  }

  double least() const { return *std::min_element(ratios_.begin(), ratios_.end()); }
  double median() {
    std::nth_element(ratios_.begin(), ratios_.begin() + ratios_.size() / 2, ratios_.end());
    return ratios_[ratios_.size() / 2];
  }

  std::vector<double> ratios_;
};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(ErrorEstimateOf, Precisions, PrecisionName);
using ErrorEstimateInDouble = ErrorEstimateOf<double>;

TYPED_TEST(ErrorEstimateOf, IsAtLeastHalfTheErrorOnAllFamilies) {
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    this->ratios_.clear();
    for (int seed = 0; seed < 10; ++seed) {
      const Model<double> model = family.make(seed);
      this->look(model, random_state(model, seed));
    }
    EXPECT_GE(this->least(), 0.5);
    EXPECT_LE(this->median(), 150);
  }
}

// Of a chain that is stretched out the rounding of a itself is nearly all, and grows with its length.
TYPED_TEST(ErrorEstimateOf, IsAtLeastHalfTheErrorOfLongStraightChains) {
  for (const int n : {7, 31}) {
    SCOPED_TRACE(n);
    this->ratios_.clear();
    const Model<double> model = straight_chain(n);
    for (int seed = 0; seed < 10; ++seed)
      for (const bool stretched : {true, false}) {
        State<double> state = random_state(model, seed);
        if (stretched) state.q.setZero();
        this->look(model, state);
      }
    ASSERT_GE(this->ratios_.size(), 15);  // of 20 rows in float some climb
    EXPECT_GE(this->least(), 0.5);
  }
}

TYPED_TEST(ErrorEstimateOf, IsAtLeastAQuarterOfTheErrorWhereMassesGrow) {
  for (const double heaviest : {1e3, 1e6, 1e9})
    for (int seed = 0; seed < 50; ++seed) {
      const Model<double> model = growing(seed, heaviest);
      this->look(model, random_state(model, seed));
    }
  ASSERT_GE(this->ratios_.size(), 10);
  EXPECT_GE(this->least(), 0.25);
}

// Of float nearly all of these climb, and of the default tolerance of double nine in ten. Roundings of one link may all have one sign: the worst of these 300 is 13 times the estimate.
TEST_F(ErrorEstimateInDouble, IsSeldomBelowAQuarterOfTheErrorOnWildMechanisms) {
  for (int seed = 0; seed < 300; ++seed) {
    DynamicsOptions options = spatial({Want::acceleration});
    options.tolerance = 1e-7;
    this->look(wild(seed), random_state(wild(seed), seed), options);
  }
  EXPECT_GE(this->ratios_.size(), 50);
  EXPECT_LE(std::ranges::count_if(this->ratios_, [](double x) { return x < 0.25; }), 3);
  EXPECT_GE(this->least(), 0.03);
}

TEST_F(ErrorEstimateInDouble, OfSlidesAloneIsAtLeastHalfTheError) {
  for (const Family& family : translational_families())
    for (int seed = 0; seed < 10; ++seed) {
      const Model<double> model = family.make(seed);
      this->look(model, random_state(model, seed),
                 {{}, {.want = {Want::acceleration}}, {Rule::translations}});
    }
  EXPECT_GE(this->least(), 0.5);
  EXPECT_LE(this->median(), 150);
}

// Where torques cancel gravity all but a twentieth, a loses as many digits, and says so.
TEST_F(ErrorEstimateInDouble, GrowsWhereTorquesCancelGravity) {
  const Model<double> model = chain(3, 6);
  const State<double> rest = [&] {
    State<double> state = random_state(model, 3).cast<double>();
    state.qd.setZero();
    return state;
  }();
  Dynamics<double> robot =
      dynamics_of<double>(model, spatial({Want::acceleration, Want::inverse_dynamics}));
  const auto error_at = [&](double fraction) {
    VectorX<double> tau(6), a(6);
    robot.gravity(rest.q, tau);
    tau *= fraction;
    return robot.forward_dynamics(rest.q, rest.qd, tau, a).error;
  };
  const double falling = error_at(double(0)), nearly_held = error_at(double(0.95));
  EXPECT_GT(nearly_held, 10 * falling);
  EXPECT_LT(nearly_held, 1e-8);
}

TEST_F(ErrorEstimateInDouble, IsThatOfOneStateInRowsToo) {
  const Model<double> model = creature(1);
  constexpr int count = 19;
  Rows<double> rows(model, count);
  Dynamics<double> robot = dynamics_of<double>(model, spatial({Want::acceleration}));
  EXPECT_EQ(rows.forward_dynamics(robot), 0);
  for (int i = 0; i < count; ++i) {
    const State<double> state = random_state(model, i).cast<double>();
    VectorX<double> a(model.nv());
    const Outcome one = robot.forward_dynamics(state.q, state.qd, state.tau, a);
    EXPECT_NEAR(rows.outcomes[i].error, one.error, 1e-3 * one.error) << i;
  }
}

}  // namespace
}  // namespace kalmarm::test
