// What the advisor observes and predicts of robots and of hard mechanisms, against multi-precision.
#include <gtest/gtest.h>

#include <cmath>

#include "accuracy/contenders/advice.hpp"
#include "accuracy/measures/measures.hpp"
#include "accuracy/truth/truth_cache.hpp"
#include "algorithms/model/plain.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

struct Setting {
  Scene scene;
  QuestionOptions asked;
  Question question;
  std::vector<State> states;
  std::unique_ptr<Advisor> advisor;

  Setting(Scene what, Want want, int count, const std::string& precision = "",
          Calls calls = Calls::of_one_state)
      : scene(std::move(what)),
        question{.want = {want}},
        states(random_states(scene, count, 3)),
        advisor(make_advisor(scene, asked, question, states, precision, calls)) {}
};

// The largest error over the states, of a or of M^-1.
double true_error(const Setting& s, Trial& trial, Want want) {
  double worst = 0;
  for (std::size_t i = 0; i < s.states.size(); ++i) {
    const State& state = s.states[i];
    const Truth<double> truth =
        cached_truth<double>(s.scene.model, state.q, {{state.tau, state.qd}}, {});
    const Outcome outcome = trial.answer(static_cast<int>(i));
    if (!outcome) return HUGE_VAL;
    const VectorX<double> x = trial.result();
    const Eigen::Index n = s.scene.model.nv();
    const double error = want == Want::inverse
                             ? matrix_error(MatrixX<double>(x.reshaped(n, n)), truth.X).scaled
                             : acceleration_error(x, truth.responses[0].a, truth.M).relative;
    worst = larger(worst, error);
  }
  return worst;
}

Model<double> with_heavy_hand(const Scene& scene, double ratio) {
  std::vector<Joint<double>> joints;
  for (int k = 0; k < scene.model.nv(); ++k) joints.push_back(scene.model.joint(k));
  joints.back().body.mass *= ratio;
  joints.back().body.moments *= ratio;
  return {std::move(joints), scene.model.names(), scene.model.nq(), scene.model.gravity()};
}

std::vector<Scene> scenes() {
  const Scene arm = load_scene("iiwa14");
  return {arm, load_scene("go2"), load_scene("chain:12"),
          generated_scene("heavy hand", with_heavy_hand(arm, 1e9))};
}

// By (5) and (6) of advisor.hpp: at least the true error, and at most `margin` of the larger of it and u, but for
// the reference's own error, which stands in every difference, times the margin, and is added.
TEST(Advice, PredictionIsNoLessThanTheTrueErrorAndNoMoreThanItsRuleSays) {
  for (const Want want : {Want::acceleration, Want::inverse})
    for (Scene& scene : scenes()) {
      Setting s(std::move(scene), want, 4);
      const auto& candidates = s.advisor->candidates();
      for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
        SCOPED_TRACE(s.scene.name + " " + candidates[i].variant + " " +
                     to_string(candidates[i].precision));
        const Observation& seen = s.advisor->observe(i);
        if (seen.failures + seen.warnings > 0) {
          EXPECT_EQ(seen.predicted, HUGE_VAL);
          continue;
        }
        const double worst = true_error(s, *candidates[i].make(), want);
        const bool is_single = candidates[i].precision == Precision::float32;
        const double u = is_single ? unit_roundoff<float>() : unit_roundoff<double>();
        EXPECT_GE(seen.predicted, worst);
        const double margin = want == Want::acceleration ? 5 : 3;  // of seven joints and more
        EXPECT_LE(seen.predicted,
                  margin * std::max(u, worst) + (1 + margin) * s.advisor->reference_error());
      }
    }
}

// Of 200 states, for 500 times as many.
TEST(Advice, PredictionHoldsForOtherStatesOfEveryRobot) {
  double least = HUGE_VAL, most = 0;  // of what is predicted over the largest error
  for (const std::string& name : shipped_robots()) {
    SCOPED_TRACE(name);
    Setting s(load_scene(name), Want::acceleration, 200);
    const std::vector<State> others = random_states(s.scene, 100'000, 4);
    const auto expect_within = [&]<class T>(T, double predicted) {
      const RobotModel robot = plain(s.scene.model);
      Dynamics<T> plainly(robot, {.question = s.question});
      Dynamics<double> truly(robot, {.tolerance = last_bits, .question = s.question});
      VectorX<T> a(plainly.nv());
      VectorX<double> exact(plainly.nv());
      double worst = 0;
      for (const State& state : others) {
        const VectorX<T> q = state.q.cast<T>(), qd = state.qd.cast<T>(), tau = state.tau.cast<T>();
        ASSERT_TRUE(plainly.forward_dynamics(q, qd, tau, a));
        ASSERT_TRUE(truly.forward_dynamics(state.q, state.qd, state.tau, exact));
        worst = std::max(worst, (a.template cast<double>() - exact).norm() / exact.norm());
      }
      EXPECT_LE(worst, predicted);
      least = std::min(least, predicted / worst);
      most = std::max(most, predicted / worst);
    };
    const auto predicted = [&](const char* precision) {
      const Setting asked(load_scene(name), Want::acceleration, 200, precision);
      EXPECT_EQ(asked.advisor->candidates().front().variant, "Ladder<default>");
      return asked.advisor->observe(0).predicted;
    };
    expect_within(float(), predicted("float32"));
    expect_within(double(), predicted("float64"));
  }
  RecordProperty("least", std::to_string(least));
  RecordProperty("most", std::to_string(most));
}

// Lanes of float32 are enough for an ordinary robot in ordinary states.
TEST(Advice, RowsInFloat32AreWithin5em5OnEveryShippedRobot) {
  for (const std::string& robot : shipped_robots()) {
    Setting s(load_scene(robot), Want::acceleration, 200, "", Calls::of_rows);
    const Candidate& first = s.advisor->candidates().front();
    EXPECT_EQ(first.variant, "Ladder<default>");
    EXPECT_EQ(first.precision, Precision::float32);
    EXPECT_LE(s.advisor->observe(0).predicted, 5e-5) << robot;
    EXPECT_GT(s.advisor->observe(0).predicted, unit_roundoff<float>()) << robot;
  }
}

TEST(Advice, PrecisionIsKeptWhereItIsGiven) {
  const Setting s(load_scene("panda"), Want::acceleration, 2);
  const auto advisor = make_advisor(s.scene, s.asked, s.question, s.states, "float64");
  for (const Candidate& candidate : advisor->candidates())
    EXPECT_EQ(candidate.precision, Precision::float64) << candidate.variant;
}

// What takes one state at a time gets no float32 of the ladder unasked; of rows nothing else has calls.
TEST(Advice, TheLadderAloneIsAdvised) {
  for (const char* const precision : {"", "float32", "float64"}) {
    const Setting s(load_scene("panda"), Want::acceleration, 1, precision);
    int advised = 0;
    for (const Candidate& candidate : s.advisor->candidates()) {
      EXPECT_EQ(candidate.advised, candidate.variant.starts_with("Ladder<")) << candidate.variant;
      if (!candidate.advised) continue;
      ++advised;
      EXPECT_EQ(to_string(candidate.precision), *precision ? std::string(precision) : "float64");
    }
    EXPECT_EQ(advised, 2);
    EXPECT_GT(s.advisor->candidates().size(), 12u);
  }
  const Setting rows(load_scene("panda"), Want::acceleration, 1, "", Calls::of_rows);
  EXPECT_EQ(rows.advisor->candidates().size(), 4u);
  for (const Candidate& candidate : rows.advisor->candidates()) EXPECT_TRUE(candidate.advised);
}

TEST(Advice, DenseVariantsAreLeftOutOfLongChains) {
  const Setting s(load_scene("chain:201"), Want::acceleration, 1);
  for (const Candidate& candidate : s.advisor->candidates())
    EXPECT_FALSE(candidate.variant.starts_with("Batch<Eigen")) << candidate.variant;
}

// A question about a part is answered about that part.
TEST(Advice, AsksTheQuestion) {
  const Scene scene = load_scene("g1");
  QuestionOptions asked;
  asked.want = {"acceleration"};
  asked.free = {"left_hip*", "left_knee*", "left_ankle*"};
  const Question question = question_of(scene, asked);
  std::vector<State> states = random_states(scene, 2, 1);
  for (State& state : states) state = asked_state(scene, question, std::move(state));
  const auto advisor = make_advisor(scene, asked, question, states);
  const auto trial = advisor->candidates()[0].make();
  ASSERT_TRUE(trial->answer(0));
  EXPECT_EQ(trial->result().size(), 6);
  EXPECT_LE(advisor->observe(0).predicted, 1e-13);
}

TEST(Advice, ToleranceBelowTheRoundoffIsBadInput) {
  const Setting s(load_scene("two_link"), Want::acceleration, 1);
  EXPECT_THROW(advise(*s.advisor, 1e-18), InputError);
}

}  // namespace
}  // namespace kalmarm
