// What the adversary takes for an error, on mechanisms whose answer is known.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "accuracy/adversary/judge.hpp"
#include "accuracy/stress/families.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/generate.hpp"

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

// Three hinges, and a ball at the end, all of them moving.
Mechanism wrist() {
  Draw draw(1);
  Joints joints(3);
  for (int k = 0; k < 3; ++k) {
    joints[k].parent = k - 1;
    joints[k].rotation = draw.turn();
    joints[k].translation = draw.direction();
    joints[k].body = draw.body(1);
  }
  Joint<double> ball;
  ball.parent = 2;
  ball.coordinate = Coordinate::quaternion;
  ball.translation = draw.direction();
  ball.body = draw.body(1);
  add_three(joints, ball);
  Mechanism out{assemble(joints, {0, 0, -9.81}), {}};
  out.state.q = VectorX<double>::Constant(out.model.nq(), 0.5);
  out.state.qd = VectorX<double>::LinSpaced(out.model.nv(), -1, 1);
  out.state.tau = VectorX<double>::LinSpaced(out.model.nv(), 3, 1);
  return out;
}

TEST(AdversaryJudge, RoundsParametersFirst) {
  const Mechanism m = held_mass(1 + 0x1p-25, 30);  // float32 holds 1
  const Verdict verdict = make_judge({"Ladder<default>", "float32"})->look(m);
  ASSERT_TRUE(verdict.silent() && verdict.known)
      << to_string(verdict.outcome.status) << ' ' << verdict.outcome.error;
  EXPECT_EQ(verdict.error, 0);
  EXPECT_EQ(verdict.value(Goal::error, usual_condition), told);
}

TEST(AdversaryJudge, ConditionIsThatOfTheDifferenceThatIsLeft) {
  // a = (f - 10 m) / m moves by u (f/m + f/m + 10 + ...) for u in each parameter
  const auto judge = make_judge({"Ladder<default>", "float64"});
  for (const double rest : {1e-2, 1e-4, 1e-6}) {
    const Verdict verdict = judge->look(held_mass(1, 10 + rest));
    EXPECT_GT(verdict.kS, 5 / rest);
    EXPECT_LT(verdict.kS, 50 / rest);
    EXPECT_NEAR(verdict.size, rest, 1e-12);
  }
}

TEST(AdversaryJudge, AnAccelerationOfZeroIsNoFind) {
  const Verdict verdict = make_judge({"Ladder<default>", "float64"})->look(held_mass(1, 10));
  EXPECT_FALSE(verdict.known);
  EXPECT_EQ(verdict.value(Goal::error, usual_condition), nothing);
}

TEST(AdversaryJudge, SeesWhatAMassRatioCosts) {
  const auto conventional = make_judge({"Sequential<Conventional>", "float64"}),
             certified = make_judge({"Ladder<last_bits>", "float64"});
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
    return out.value(Goal::error, usual_condition);
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

TEST(AdversaryJudge, AClaimIsComparedWithTheErrorAndAPromiseWithWhatTheParametersLeave) {
  const auto one = [](long double value) {
    return Answer<long double>{MatrixX<long double>::Constant(1, 1, value)};
  };
  const auto value = [&](const std::string& precision, double claimed, double kS) {
    const Case asked{"", precision, Want::acceleration, Goal::claim};
    Outcome outcome;
    outcome.error = claimed;
    return verdict_of(asked, outcome, one(1e-3L), one(1), kS, 0).value(asked.goal, usual_condition);
  };
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NEAR(value("float64", 1e-4, 1), 1, 1e-12);
  EXPECT_NEAR(value("float64", 4e-3, 1), std::log10(0.25), 1e-12);
  EXPECT_NEAR(value("float64", 1e-4, 1e9), 1, 1e-12);  // a claim is about the rounded mechanism
  EXPECT_NEAR(value("float32", none, 1), -1, 1e-12);
  EXPECT_NEAR(value("float64", none, 1), 5, 1e-12);
  EXPECT_NEAR(value("float64", none, 10 * usual_condition), 3, 1e-12);
  EXPECT_NEAR(value("float64", 0, 1), 5, 1e-12);                               // no claim
  EXPECT_NEAR(value("float64", 1e-30, 1), std::log10(1e-3 / 0x1p-53), 1e-12);  // of what is rounded
  EXPECT_LT(value("float64", 0.02, 1), told);                                  // warns
}

// A mass ratio that costs the conventional form digits, whatever it is asked for.
TEST(AdversaryJudge, SeesTheSameLossInEveryTask) {
  for (const Want task : {Want::acceleration, Want::inverse, Want::solve, Want::diagonal}) {
    SCOPED_TRACE(to_string(task));
    const double ratio = 1e8;
    const Verdict lost =
        make_judge({"Sequential<Conventional>", "float64", task})->look(heavy_tip(ratio));
    ASSERT_TRUE(lost.silent() && lost.known);
    EXPECT_GT(lost.error, 1e-5 * 0x1p-53 * ratio);
    EXPECT_LT(lost.error, 100 * 0x1p-53 * ratio);
  }
}

TEST(AdversaryJudge, EveryTaskOfAnOrdinaryRobotIsRightToLastDigits) {
  for (const Want task : tasks()) {
    SCOPED_TRACE(to_string(task));
    const Verdict found = make_judge({"Ladder<default>", "float64", task})->look(wrist());
    ASSERT_TRUE(found.silent() && found.known);
    EXPECT_LT(found.error, 1e-13);
    EXPECT_GT(found.kS, 0.1);
    EXPECT_LT(found.kS, usual_condition);
  }
}

TEST(AdversaryJudge, TheStateAmongRowsIsTheOneThatIsJudged) {
  for (const char* const variant : {"Ladder<default>", "Ladder<last_bits>", "Sequential<UD>"}) {
    SCOPED_TRACE(variant);
    Case asked{variant, "float64"};
    const Verdict alone = make_judge(asked)->look(wrist());
    asked.rows = true;
    const Verdict among = make_judge(asked)->look(wrist());
    ASSERT_TRUE(alone.silent() && among.silent());
    EXPECT_LT(alone.error, 1e-13);
    EXPECT_LT(among.error, 1e-13);
    EXPECT_EQ(among.kS, alone.kS);
  }
}

TEST(AdversaryJudge, AsksTheKernelThatIsMeant) {
  const auto kernel_of = [](double x, Kernel kernel) {
    const Genome genome{3, std::vector<double>(static_cast<std::size_t>(length_of(3)), x)};
    const Case asked{"Ladder<default>", "float32", Want::acceleration, Goal::error, kernel};
    return make_judge(asked)->kernel(decode(genome, kernel));
  };
  for (const Kernel kernel : {Kernel::spatial, Kernel::spatial_at_rest, Kernel::translational})
    EXPECT_EQ(kernel_of(0.4, kernel), kernel) << to_string(kernel);
}

TEST(AdversaryJudge, RefusesWhatAVariantDoesNotAnswer) {
  EXPECT_THROW(make_judge({"Sequential<UD>", "float64", Want::derivatives}), InputError);
}

TEST(AdversaryJudge, KnowsTheVariantsOfTheRegistry) {
  for (const auto& variant : registered_variants<double>())
    EXPECT_TRUE(make_judge({variant.name, "float64"})) << variant.name;
  EXPECT_THROW(make_judge({"Ladder<Lucky>", "float64"}), InputError);
}

}  // namespace
}  // namespace kalmarm::adversary
