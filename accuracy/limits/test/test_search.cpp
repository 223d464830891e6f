// The search against random poses, against a closed form, and against itself on other threads.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "accuracy/limits/campaign.hpp"
#include "robots/scene/generate.hpp"

namespace kalmarm::limits {
namespace {

constexpr Effort little = {
    .random = 100, .global = 400, .local = 200, .random_float64 = 20, .local_float64 = 50};

// A link with I = 1 about its joint, and at its end, 1 m on, a point mass m on a massless link of
// 1 m. With c = cos q2
//   M = [I + 2 m (1 + c)  m (1 + c); m (1 + c)  m],   D(1) = I + 2 m (1 + c) - m (1 + c)^2
//                                                          = I + m sin^2 q2
// Cholesky subtracts: where the links are in line I alone is left of terms of 4 m, with an error of
// u m; no other pose is as bad.
Scene point_on_two_links() {
  Joint<double> first;
  first.body = {0, {0, 0, 0}, {1, 0, 0, 0}, {0, 0, 1}};
  Joint<double> second;
  second.parent = 0;
  second.q_index = 1;
  second.translation = {1, 0, 0};
  second.body = {1, {1, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}};
  return generated_scene("point:2", assemble({first, second}, {0, 0, -9.81}));
}

Model<double> loaded(const Scene& scene, double times) {
  for (const Stress& stress : stresses_of(scene))
    if (stress.name == "payload") return stress.model(times);
  throw std::runtime_error("no payload");
}

TEST(LimitsSearch, FindsThePoseThatTheClosedFormSaysIsWorst) {
  const Scene scene = point_on_two_links();
  for (const double mass : {1e3, 1e4, 1e5}) {
    SCOPED_TRACE(mass);
    const Found found = search_worst(scene, loaded(scene, mass - 1), Want::inverse, little, 1, {});
    const double u = 0x1p-24;
    const double D = 1 + mass * std::pow(std::sin(found.states[1].q[1]), 2);
    EXPECT_GT(found.tallies[1].worst, u * mass);
    EXPECT_LT(found.tallies[1].worst, 20 * u * mass);
    EXPECT_LT(D, 2);
    EXPECT_LE(found.tallies[0].worst, u);  // one state in float32 is float64's, rounded
  }
}

TEST(LimitsSearch, TheCertifiedFormKeepsAllDigitsOfAnAcceleration) {
  const Scene scene = point_on_two_links();
  const Found found = search_worst(scene, loaded(scene, 1e5), Want::acceleration, little, 1, {});
  const double u = 0x1p-53;
  EXPECT_LT(found.tallies[5].worst, 4 * u);  // Ladder<last_bits> in float64
}

// Of Ladder<default> in float32.
double worst_of_random(const Scene& scene, const Model<double>& model, Want task, int poses) {
  Judge<float> judge(model, task);
  double out = 0;
  for (const State& state : random_states(scene, poses, 1))
    if (!(judge.set_state(held_by_float(state)) < 1)) out = std::max(out, judge(0).error);
  return out;
}

TEST(LimitsSearch, FindsNoLessThanAThousandRandomPoses) {
  for (const char* robot : {"iiwa14", "panda"}) {
    const Scene scene = load_scene(robot);
    const Model<double> model = loaded(scene, 100);
    for (const Want task : tasks) {
      SCOPED_TRACE(std::string(robot) + ' ' + to_string(task));
      const Found found = search_worst(scene, model, task, effort_for(scene.model.nv()), 1, {});
      EXPECT_GE(found.tallies[0].worst, worst_of_random(scene, model, task, 1000));
    }
  }
}

template <class T>
void expect_agreement(Want task, int first, double roundoff) {
  const Scene scene = load_scene("panda");
  const Model<double> model = loaded(scene, 1e4);
  Judge<T> judge(model, task);
  for (const State& any : random_states(scene, 3, 1)) {
    const State state = held_by_float(any);
    ASSERT_EQ(judge.set_state(state), 1);
    const auto truth = verify(model, task, state);
    ASSERT_TRUE(truth);
    for (int i = 0; i < searched_variants; ++i) {
      SCOPED_TRACE(variants[i]);
      const double error = (*truth)[first + i].error;
      EXPECT_NEAR(judge(i).error, error, 1e-6 * error + roundoff);
    }
  }
}

TEST(LimitsJudge, AgreesWithMultiPrecision) {
  for (const Want task : tasks) {
    SCOPED_TRACE(to_string(task));
    expect_agreement<float>(task, 0, 1e-12);
    expect_agreement<double>(task, static_cast<int>(variants.size()), 1e-15);
  }
}

Model<double> slide_of(double mass) {
  Joint<double> slide;
  slide.slides = true;
  slide.coordinate = Coordinate::distance;
  slide.body = {mass, {0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}};
  return assemble({slide}, {0, 0, -10});
}

TEST(LimitsJudge, FloatIsJudgedAgainstTheRobotOfTheFile) {
  const Model<double> model = slide_of(1 + 0x1p-25);  // float32 holds 1
  const VectorX<double> zero = VectorX<double>::Zero(1);
  for (const Want task : tasks) {
    Judge<float> judge(model, task);
    EXPECT_EQ(judge.set_state({zero, zero, VectorX<double>::Constant(1, 100)}), 1);
    EXPECT_NEAR(judge(0).error, task == Want::inverse ? 0x1p-25 : 0x1p-25 * 100 / 90, 1e-13);
  }
}

// A mass that falls, and is held: a is what is left of gravity.
TEST(LimitsJudge, StatesInWhichNothingIsLeftOfTheAccelerationAreNotFair) {
  const Model<double> model = slide_of(2);
  const VectorX<double> zero = VectorX<double>::Zero(1);
  for (const Want task : tasks) {
    Judge<float> judge(model, task);
    const auto fairness = [&](double tau) {
      return judge.set_state({zero, zero, VectorX<double>::Constant(1, tau)});
    };
    EXPECT_EQ(fairness(0), 1);
    // a = -0.1, and gravity alone -10
    EXPECT_NEAR(fairness(19.8), task == Want::inverse ? 1 : 0.1, 1e-12);
  }
}

TEST(LimitsSearch, WhereMIsSingularNothingIsFound) {
  Scene scene = point_on_two_links();
  std::vector<Joint<double>> joints = {scene.model.joint(0), scene.model.joint(1)};
  joints[1].body.com.setZero();  // a point on its axis
  scene = generated_scene("singular:2", assemble(joints, {0, 0, -9.81}));
  for (const Want task : tasks) {
    const Found found = search_worst(scene, scene.model, task, little, 1, {});
    EXPECT_TRUE(found.states.empty());
    EXPECT_GT(found.evaluations, 0);
    for (const Tally& tally : found.tallies) EXPECT_LT(tally.worst, 0);
  }
}

TEST(LimitsCampaign, IsTheSameOnAnyNumberOfThreads) {
  const Scene scene = load_scene("two_link");
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return search_all(scene, {20, 50, 20, 5, 10}, 7, [](const std::string&) {});
  };
  const std::vector<Swept> one = run(1), four = run(4);
  ASSERT_EQ(one.size(), four.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(one[i].values, four[i].values);
    for (std::size_t task = 0; task < tasks.size(); ++task)
      for (std::size_t value = 0; value < one[i].values.size(); ++value)
        for (std::size_t c = 0; c < 2 * variants.size(); ++c) {
          const Tally &a = one[i].found[task][value].tallies[c],
                      &b = four[i].found[task][value].tallies[c];
          EXPECT_EQ(a.worst, b.worst);
          EXPECT_EQ(a.refused, b.refused);
          EXPECT_EQ(a.silent, b.silent);
        }
  }
}

}  // namespace
}  // namespace kalmarm::limits
