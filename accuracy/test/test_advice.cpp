// What the advisor observes and predicts of robots and of hard mechanisms, against multi-precision.
#include <gtest/gtest.h>

#include <cmath>

#include "accuracy/advice.hpp"
#include "accuracy/measures.hpp"
#include "accuracy/truth_cache.hpp"
#include "robots/input_error.hpp"

namespace kalmarm {
namespace {

struct Setting {
  Scene scene;
  QuestionOptions asked;
  Question question;
  std::vector<State> states;
  std::unique_ptr<Advisor> advisor;

  Setting(Scene what, Want want, int count)
      : scene(std::move(what)),
        question{.want = {want}},
        states(random_states(scene, count, 3)),
        advisor(make_advisor(scene, asked, question, states)) {}
};

// The largest error over the states, of a and of M^-1.
double true_error(const Setting& s, Trial& trial, Want want) {
  double worst = 0;
  for (std::size_t i = 0; i < s.states.size(); ++i) {
    const State& state = s.states[i];
    const Truth<double> truth =
        cached_truth<double>(s.scene.model, state.q, {{state.tau, state.qd}}, {});
    if (!trial.answer(static_cast<int>(i))) return HUGE_VAL;
    const VectorX<double> x = trial.result();
    const Eigen::Index n = s.scene.model.nv();
    worst = larger(worst, want == Want::inverse
                              ? matrix_error(MatrixX<double>(x.reshaped(n, n)), truth.X).scaled
                              : acceleration_error(x, truth.responses[0].a, truth.M).relative);
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

// By (5) of advisor.hpp: at least the true error, and at most 2 of the larger of it and u, but for
// the reference's own error, which stands in the difference, doubled, and is added.
TEST(Advice, PredictionIsOneToTwoTimesTheTrueErrorOfEveryContender) {
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
        const double error = true_error(s, *candidates[i].make(), want);
        const bool is_single = candidates[i].precision == Precision::float32;
        const double u = is_single ? unit_roundoff<float>() : unit_roundoff<double>();
        EXPECT_GE(seen.predicted, error);
        EXPECT_LE(seen.predicted, 2 * std::max(u, error) + 3 * s.advisor->reference_error());
      }
    }
}

// Float32 by the fast path is enough for an ordinary robot in ordinary states.
TEST(Advice, FastPathInFloat32IsWithin1em5OnEveryShippedRobot) {
  for (const std::string& robot : shipped_robots()) {
    Setting s(load_scene(robot), Want::acceleration, 200);
    const Candidate& first = s.advisor->candidates().front();
    EXPECT_EQ(first.variant, "Fast<Conventional>");
    EXPECT_EQ(first.precision, Precision::float32);
    EXPECT_LE(s.advisor->observe(0).predicted, 1e-5) << robot;
    EXPECT_GT(s.advisor->observe(0).predicted, unit_roundoff<float>()) << robot;
  }
}

TEST(Advice, PrecisionIsKeptWhereItIsGiven) {
  const Setting s(load_scene("panda"), Want::acceleration, 2);
  const auto advisor = make_advisor(s.scene, s.asked, s.question, s.states, "float64");
  for (const Candidate& candidate : advisor->candidates())
    EXPECT_EQ(candidate.precision, Precision::float64) << candidate.variant;
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
  const auto trial = advisor->candidates()[1].make();
  ASSERT_TRUE(trial->answer(0));
  EXPECT_EQ(trial->result().size(), 6);
  EXPECT_LE(advisor->observe(1).predicted, 1e-13);
}

TEST(Advice, ToleranceBelowTheRoundoffIsBadInput) {
  const Setting s(load_scene("two_link"), Want::acceleration, 1);
  EXPECT_THROW(advise(*s.advisor, 1e-18), InputError);
}

}  // namespace
}  // namespace kalmarm
