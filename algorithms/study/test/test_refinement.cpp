// What refinement keeps, what it refuses, what it says of its error; and the warning that stands
// between a regular and a singular mechanism.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "algorithms/study/inverse_mass/refinement/refinement.hpp"
#include "algorithms/study/solver.hpp"
#include "algorithms/test/dense_mechanics.hpp"
#include "algorithms/test/models.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

// Refines x = 1 with corrections made by hand.
struct Refining {
  Model<double> model = chain(1, 1);
  RefinementWorkspace<double> ws{model};
  VectorX<double> x = VectorX<double>::Ones(1);

  template <class Correct>
  Refinement operator()(int most, int enough, const Correct& correct) {
    return refine<double>(
        most, enough, [&](const VectorX<double>& y, VectorX<double>& d) { d[0] = correct(y[0]); },
        ws, x);
  }
};

TEST(Refine, KeepsStepsThatConverge) {
  Refining refining;
  const double truth = 1.05;
  const Refinement r = refining(2, 1, [&](double x) { return 0.9 * (truth - x); });
  EXPECT_EQ(r.steps, 2);
  EXPECT_NEAR(refining.x[0], truth - 0.05 * 0.01, 1e-15);
  EXPECT_NEAR(r.error, 0.9 * 0.05 * 0.01, 1e-12);  // the correction that it did not apply
}

TEST(Refine, TakesBackAStepThatTheNextCorrectionDoesNotConfirm) {
  Refining refining;
  const Refinement r = refining(3, 1, [](double) { return 0.05; });
  EXPECT_EQ(r.steps, 0);
  EXPECT_EQ(refining.x[0], 1);
  EXPECT_NEAR(r.error, 0.05, 1e-15);
}

TEST(Refine, RefusesACorrectionOfTheSizeOfTheResult) {
  Refining refining;
  const Refinement r = refining(1, 1, [&](double x) { return 1.2 - x; });  // right, but who knows
  EXPECT_EQ(r.steps, 0);
  EXPECT_EQ(refining.x[0], 1);
  EXPECT_NEAR(r.error, 0.2, 1e-15);
}

TEST(Refine, StopsWhereItIsGoodEnough) {
  Refining refining;
  int calls = 0;
  refining(3, 4, [&](double) { return ++calls, 3 * unit_roundoff<double>(); });
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(refining.x[0], 1);
}

TEST(Refine, NeverAppliesANaN) {
  Refining refining;
  refining(3, 1, [](double) { return std::numeric_limits<double>::quiet_NaN(); });
  EXPECT_EQ(refining.x[0], 1);
}

Model<double> heavy_tip(std::uint64_t seed, double ratio) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < 12; ++k) {
    Joint<double> joint = random_joint(random, k - 1);
    if (k == 11) joint.body.mass *= ratio, joint.body.moments *= ratio;
    builder.add(joint);
  }
  return builder.build();
}

struct Solved {
  double error, estimate;
  bool widened;
};

template <class T>
Solved solve_heavy_tip(const std::string& variant, std::uint64_t seed, double ratio) {
  const Model<T> model = heavy_tip(seed, ratio).cast<T>();
  const State<T> state = random_state(heavy_tip(seed, ratio), seed + 100).cast<T>();
  VectorX<T> a(model.nv());
  const Outcome outcome =
      make_solver<T>(variant, model)->acceleration(state.q, state.qd, state.tau, a);
  EXPECT_TRUE(outcome) << variant;
  const Model<Mp> exact_model = model.template cast<Mp>();
  const State<Mp> exact = state.template cast<Mp>();
  const World world(exact_model, exact.q, exact.qd);
  const VectorX<Mp> truth =
      Eigen::LDLT<MatrixX<Mp>>(world.mass_matrix()).solve(exact.tau - world.bias());
  const Mp error = (a.template cast<Mp>() - truth).norm() / truth.norm();
  return {error.convert_to<double>(), outcome.error, outcome.widened};
}

// How many of ten were widened.
template <class T>
int expect_last_bit(const std::string& variant, double ratio) {
  const double u = unit_roundoff<T>();
  int widened = 0;
  for (int seed = 1; seed <= 10; ++seed) {
    const Solved solved = solve_heavy_tip<T>(variant, seed, ratio);
    EXPECT_LE(solved.error, 2 * u) << variant << " seed " << seed;
    EXPECT_LE(solved.estimate, 3 * solved.error) << variant << " seed " << seed;
    EXPECT_GE(solved.estimate, solved.error / 3) << variant << " seed " << seed;
    widened += solved.widened;
  }
  return widened;
}

// Unrefined, Conventional loses 8 digits here.
TEST(WideRefined, IsRightToTheLastBitAndKnowsItsError) {
  expect_last_bit<double>("WideRefined<Sequential<Conventional>>", 1e8);
  EXPECT_EQ(expect_last_bit<double>("WideRefined<FactoredBias<ArrayGivens>>", 1e8), 0);
}

TEST(WideRefined, OfFloat32GoesOnInFloat64WhereItsFactorsCannotHelp) {
  const char* variant = "WideRefined<FactoredBias<ArrayGivens>>";
  EXPECT_EQ(expect_last_bit<float>(variant, 1e2), 0);
  EXPECT_GT(expect_last_bit<float>(variant, 1e8), 0);
  EXPECT_GT(expect_last_bit<float>(variant, 1e12), 0);
}

TEST(MixedPrecision, OfFloat32FactorsIsRightInFloat64) {
  for (int seed = 1; seed <= 10; ++seed)
    EXPECT_LE(solve_heavy_tip<double>("MixedPrecision<FactoredBias<ArrayGivens>>", seed, 10).error,
              50 * unit_roundoff<double>());
}

// A massless link between hinges at an angle: singular at 0, and D falls as its square.
Outcome between_hinges(const std::string& variant, double angle) {
  Grown m(7);
  const Eigen::Quaterniond turn(std::cos(angle / 2), std::sin(angle / 2), 0, 0);
  m.add(m.gimbal(m.add_massless(m.joint(m.root)), turn));
  const Mechanism mechanism = m.mechanism("massless_link_between_hinges", {}, true);
  const VectorX<double> ones = VectorX<double>::Ones(mechanism.model.nv());
  VectorX<double> a = ones;
  return make_solver<double>(variant, mechanism.model)->acceleration(mechanism.q, ones, ones, a);
}

TEST(Warning, StandsBetweenRegularAndSingular) {
  for (const char* variant : {"Sequential<Conventional>", "Sequential<ArrayMGS>",
                              "Scan<Conventional>", "Scan<SquareRoot>"}) {
    SCOPED_TRACE(variant);
    int regular = 0, warned = 0, refused = 0;
    for (double angle = 0.1; angle > 1e-18; angle /= 1.5) {
      const Outcome outcome = between_hinges(variant, angle);
      if (!outcome) {
        ++refused;
      } else if (outcome.near_singular) {
        ++warned;
        EXPECT_TRUE(outcome.warns());
        EXPECT_GT(outcome.scale, outcome.D);
        EXPECT_GE(outcome.joint, 0);
      } else {
        ++regular;
        EXPECT_EQ(warned + refused, 0) << "regular again at " << angle;
      }
    }
    EXPECT_GT(regular, 0);
    EXPECT_GT(warned, 0);
    EXPECT_GT(refused, 0);
  }
}

}  // namespace
}  // namespace kalmarm::test
