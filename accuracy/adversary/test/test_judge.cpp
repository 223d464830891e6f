// What the adversary takes for an error, on mechanisms whose answer is known.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "accuracy/adversary/judge.hpp"
#include "accuracy/stress/families.hpp"
#include "algorithms/solver.hpp"
#include "robots/generate.hpp"
#include "robots/input_error.hpp"

namespace kalmarm::adversary {
namespace {

VectorX<double> value(double x) { return VectorX<double>::Constant(1, x); }

// A mass that falls, and is held by a force.
Mechanism held_mass(double mass, double force) {
  Joint<double> slide;
  slide.slides = true;
  slide.coordinate = Coordinate::distance;
  slide.body = {mass, {0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}};
  return {assemble({slide}, {0, 0, -10}), {value(0), value(0), value(force)}};
}

// A heavy link at the tip of a chain: the conventional form loses u times the mass ratio.
Mechanism heavy_tip(double ratio) {
  for (const stress::Family& family : stress::families())
    if (family.name == "heavy_tip") {
      const stress::Case made = family.make(ratio, 1);
      return {made.model, {made.q, made.qd, VectorX<double>::Ones(made.model.nv())}};
    }
  throw std::runtime_error("no heavy_tip");
}

TEST(AdversaryJudge, RoundsParametersFirst) {
  const Mechanism m = held_mass(1 + 0x1p-25, 30);  // float32 holds 1
  const Verdict verdict = make_judge("Fast<Conventional>", "float32")->look(m);
  ASSERT_TRUE(verdict.silent() && verdict.known);
  EXPECT_EQ(verdict.error, 0);
  EXPECT_EQ(verdict.value(usual_condition), told);
}

TEST(AdversaryJudge, ConditionIsThatOfTheDifferenceThatIsLeft) {
  // a = (f - 10 m) / m moves by u (f/m + f/m + 10 + ...) for u in each parameter
  const auto judge = make_judge("Fast<Conventional>", "float64");
  for (const double rest : {1e-2, 1e-4, 1e-6}) {
    const Verdict verdict = judge->look(held_mass(1, 10 + rest));
    EXPECT_GT(verdict.kS, 5 / rest);
    EXPECT_LT(verdict.kS, 50 / rest);
    EXPECT_NEAR(verdict.size, rest, 1e-12);
  }
}

TEST(AdversaryJudge, AnAccelerationOfZeroIsNoFind) {
  const Verdict verdict = make_judge("Fast<Conventional>", "float64")->look(held_mass(1, 10));
  EXPECT_FALSE(verdict.known);
  EXPECT_EQ(verdict.value(usual_condition), nothing);
}

TEST(AdversaryJudge, SeesWhatAMassRatioCosts) {
  const auto conventional = make_judge("Sequential<Conventional>", "float64"),
             certified = make_judge("Fast<Certified>", "float64");
  for (const double ratio : {1e6, 1e9}) {
    const Verdict verdict = conventional->look(heavy_tip(ratio));
    ASSERT_TRUE(verdict.silent());
    EXPECT_GT(verdict.error, 1e-4 * 0x1p-53 * ratio);
    EXPECT_LT(verdict.error, 10 * 0x1p-53 * ratio);
    EXPECT_LT(certified->look(heavy_tip(ratio)).error, 1e-15);
  }
}

TEST(AdversaryJudge, SilentErrorsAreAboveWarningsAndTheseAboveRefusals) {
  const auto at = [](Outcome outcome, double error, double kS, double size = 1) {
    Verdict out{.outcome = outcome};
    out.error = error;
    out.size = size;
    out.kS = kS;
    return out.value(usual_condition);
  };
  Outcome ok, near, nearer, singular;
  near.near_singular = nearer.near_singular = true;
  near.D = 1e-13, nearer.D = 1e-12;
  near.scale = nearer.scale = singular.scale = 1;
  singular.status = Outcome::Status::singular;
  singular.D = 1e-16;
  EXPECT_DOUBLE_EQ(at(ok, 1e-3, 1), -3);
  EXPECT_DOUBLE_EQ(at(ok, 1e-3, 100 * usual_condition), -7);
  EXPECT_DOUBLE_EQ(at(ok, 1e-3, 1, 0.1 * smallest), -5);
  EXPECT_EQ(at(ok, 0, 1), told);
  EXPECT_LT(at(nearer, 1, 1), told);
  EXPECT_LT(at(near, 1, 1), at(nearer, 1, 1));
  EXPECT_LT(at(singular, 1, 1), at(near, 1, 1));
  Outcome inaccurate, worse;
  inaccurate.error = 0.02, worse.error = 2;
  EXPECT_LT(at(inaccurate, 0.02, 1), told);
  EXPECT_LT(at(worse, 2, 1), at(inaccurate, 0.02, 1));
}

TEST(AdversaryJudge, KnowsTheVariantsOfTheRegistry) {
  for (const auto& variant : registered_variants<double>())
    EXPECT_TRUE(make_judge(variant.name, "float64")) << variant.name;
  EXPECT_THROW(make_judge("Fast<Lucky>", "float64"), InputError);
}

}  // namespace
}  // namespace kalmarm::adversary
