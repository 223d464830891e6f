// The advisor's rule, on candidates whose errors and times are known, and on tolerances of the door.
#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/advisor/advisor.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm {
namespace {

const double u32 = unit_roundoff<float>(), u64 = unit_roundoff<double>();

// q, qd and tau of rows that are drawn once.
TrialStates states_of(const RobotModel& model, int count) {
  TrialStates out;
  out.count = count;
  out.nq = model.nq;
  out.nv = model.nv();
  for (int i = 0; i < count * out.nq; ++i) out.q.push_back(std::sin(1 + 1.7 * i));
  for (int i = 0; i < count * out.nv; ++i) {
    out.qd.push_back(std::cos(2 + 1.3 * i));
    out.tau.push_back(std::sin(3 + 0.9 * i));
  }
  return out;
}

// Answers what the reference does but for a relative error; a clock goes on meanwhile.
class Known final : public Trial {
 public:
  struct Behaviour {
    double error = 0, microseconds = 0;
    Outcome outcome = {};
  };

  Known(const RobotModel& model, const TrialStates& states, const Behaviour& behaviour,
        double& nanoseconds)
      : robot_(model, {.question = {.want = {Want::acceleration}}}),
        states_(states),
        behaviour_(behaviour),
        nanoseconds_(nanoseconds),
        a_(model.nv()) {}

  Outcome answer(int state) override {
    const auto row = [&](const std::vector<double>& rows, int width) {
      return VectorView<const double>(rows.data() + std::ptrdiff_t(state) * width, width);
    };
    static_cast<void>(robot_.forward_dynamics(
        row(states_.q, states_.nq), row(states_.qd, states_.nv), row(states_.tau, states_.nv), a_));
    a_ *= 1 + behaviour_.error;
    nanoseconds_ += 1e3 * behaviour_.microseconds;
    return behaviour_.outcome;
  }
  VectorX<double> result() const override { return a_; }
  void poison() override { a_.setConstant(std::nan("")); }

 private:
  Dynamics<double> robot_;
  TrialStates states_;
  Behaviour behaviour_;
  double& nanoseconds_;
  VectorX<double> a_;
};

class AdvisorsRule : public testing::Test {
 protected:
  void add(const char* name, Precision precision, const Known::Behaviour& behaviour,
           bool advised = true) {
    const auto make = [this, behaviour] {
      return std::make_unique<Known>(model, states, behaviour, nanoseconds);
    };
    advisor.add({name, precision, make, advised});
  }

  std::string choice(double tolerance) {
    const Advice advice = advisor.advise(tolerance);
    return (advice.enough ? "" : "not enough: ") + advisor.candidates()[advice.candidate].variant;
  }

  RobotModel model = kalmarm::plain(test::chain(1, 3));
  TrialStates states = states_of(model, 5);
  double nanoseconds = 0;
  Advisor advisor{model, {.want = {Want::acceleration}}, states, [this] { return nanoseconds; }};
};

TEST_F(AdvisorsRule, TheFastestThatIsEnoughIsAdvised) {
  add("slow", Precision::float64, {.error = 1e-14, .microseconds = 300});
  add("fast", Precision::float64, {.error = 1e-4, .microseconds = 10});
  add("middle", Precision::float64, {.error = 1e-8, .microseconds = 60});
  EXPECT_EQ(choice(1e-3), "fast");
  EXPECT_EQ(choice(1e-7), "middle");
  EXPECT_EQ(choice(1e-9), "slow");
  EXPECT_EQ(choice(1e-15), "not enough: slow");
}

TEST_F(AdvisorsRule, OfAlikeTimesTheFirstInTheListIsAdvised) {
  add("first", Precision::float32, {.error = 1e-5, .microseconds = 200});
  add("second", Precision::float64, {.error = 1e-9, .microseconds = 195});
  EXPECT_EQ(choice(1e-3), "first");
  EXPECT_EQ(choice(1e-6), "second");
}

TEST_F(AdvisorsRule, WhatIsComparedWithIsObservedButNeverAdvised) {
  add("other", Precision::float64, {.error = 1e-15, .microseconds = 1}, false);
  add("own", Precision::float64, {.error = 1e-6, .microseconds = 50});
  EXPECT_EQ(choice(1e-3), "own");
  EXPECT_EQ(choice(1e-9), "not enough: own");
  EXPECT_NEAR(advisor.observe(0).worst, 1e-15, 10 * u64);
}

// Of three joints 500^(1/3) times.
TEST_F(AdvisorsRule, PredictionIsTheLargestErrorTimesAMarginAndNoLessThanThatOfARoundoff) {
  const double margin = std::cbrt(500.0);
  add("known", Precision::float64, {.error = 1e-5});
  add("exact", Precision::float64, {});
  add("single", Precision::float32, {});
  const double reference = advisor.reference_error();
  EXPECT_LE(reference, 10 * u64);
  EXPECT_NEAR(advisor.observe(0).worst, 1e-5, 1e-10);
  EXPECT_NEAR(advisor.observe(0).predicted, margin * 1e-5, 1e-9);
  EXPECT_NEAR(advisor.observe(1).predicted, margin * u64 + reference, 50 * u64);
  EXPECT_NEAR(advisor.observe(2).predicted, margin * u32, 50 * u64);
}

TEST_F(AdvisorsRule, FailureAndWarningAreInfiniteErrors) {
  add("fails", Precision::float64, {.outcome = {.status = Outcome::Status::singular}});
  add("warns", Precision::float64, {.outcome = {.near_singular = true}});
  add("nan", Precision::float64, {.error = std::nan("")});
  add("sound", Precision::float64, {.error = 0.05, .microseconds = 100});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(advisor.observe(i).predicted, HUGE_VAL) << i;
  EXPECT_EQ(advisor.observe(0).failures, 5);
  EXPECT_EQ(advisor.observe(1).warnings, 5);
  EXPECT_EQ(choice(0.5), "sound");
  EXPECT_EQ(choice(0.1), "not enough: sound");
}

TEST_F(AdvisorsRule, ToleranceBelowTheRoundoffIsRefused) {
  add("any", Precision::float64, {});
  EXPECT_THROW(advisor.advise(1e-17), std::invalid_argument);
  EXPECT_THROW(advisor.advise(std::nan("")), std::invalid_argument);
}

TEST(Advisor, QuestionWithoutWantsOrWithDerivativesIsRefused) {
  const RobotModel model = kalmarm::plain(test::chain(1, 3));
  EXPECT_THROW(Advisor(model, {}, states_of(model, 1)), std::invalid_argument);
  EXPECT_THROW(Advisor(model, {.want = {Want::derivatives}}, states_of(model, 1)),
               std::invalid_argument);
}

Recommendation advice_for(const Model<double>& chain, double tolerance) {
  const RobotModel model = kalmarm::plain(chain);
  const TrialStates s = states_of(model, 20);
  return recommend(model, s.q, s.qd, s.tau, {.tolerance = tolerance});
}

Model<double> heavy_tip(double ratio) {
  const Model<double> chain = test::chain(3, 8);
  std::vector<Joint<double>> joints;
  for (int k = 0; k < chain.nv(); ++k) joints.push_back(chain.joint(k));
  joints.back().body.mass *= ratio;
  joints.back().body.moments *= ratio;
  return {std::move(joints), chain.names(), chain.nq(), Vector3<double>(0, 0, -9.81)};
}

// recommend() takes the machine's times, which a test cannot know: what follows from the errors
// alone is asked here, and which is the fastest of those that are enough by the clock above.
TEST(Recommend, ReasonNamesWhatIsRecommended) {
  const Recommendation some = advice_for(test::chain(1, 7), 1e-3);
  EXPECT_TRUE(some.enough);
  EXPECT_LE(some.worst, some.predicted);
  EXPECT_LE(some.predicted, 1e-3);
  const std::string asked = some.tolerance == last_bits ? "the last bits" : "the default tolerance";
  const std::string name = asked + " in " + to_string(some.precision);
  EXPECT_TRUE(some.reason.starts_with(name)) << some.reason;
}

// Rows of one call are the same states, answered by lanes: to the roundoff of T.
template <class T>
void expect_rows_as_one_by_one(const std::set<Want>& want) {
  const RobotModel model = kalmarm::plain(test::chain(1, 5));
  const TrialStates states = states_of(model, 7);
  const auto trial = [&](bool in_rows) {
    return make_trial(Dynamics<T>(model, {.question = {.want = want}}), want, 0, states, in_rows);
  };
  const auto one = trial(false), rows = trial(true);
  for (const int i : {3, 0, 6}) {
    one->poison();
    rows->poison();
    ASSERT_TRUE(one->answer(i));
    ASSERT_TRUE(rows->answer(i));
    const VectorX<double> x = one->result(), y = rows->result();
    ASSERT_EQ(x.size(), y.size());
    EXPECT_LE((x - y).norm(), 100 * double(unit_roundoff<T>()) * x.norm()) << i;
  }
}

TEST(Trials, RowsAnswerAsOneByOne) {
  for (const Want want : {Want::acceleration, Want::inverse, Want::diagonal, Want::log_det,
                          Want::mass, Want::solve, Want::inverse_dynamics}) {
    SCOPED_TRACE(to_string(want));
    expect_rows_as_one_by_one<float>({want});
    expect_rows_as_one_by_one<double>({want});
  }
  expect_rows_as_one_by_one<float>({Want::acceleration, Want::inverse});
}

TEST(Recommend, Float32IsForRowsAlone) {
  const RobotModel model = kalmarm::plain(test::chain(1, 7));
  const TrialStates s = states_of(model, 20);
  const Recommendation one = recommend(model, s.q, s.qd, s.tau, {.tolerance = 1e-2, .rows = false});
  EXPECT_EQ(one.precision, Precision::float64);
  EXPECT_LE(one.worst, 1e-12);
  // Lanes of float32 have their own errors, which rounding a double has not.
  Advisor rows(model, {.want = {Want::acceleration}}, states_of(model, 20));
  rows.add({}, "default", true);
  EXPECT_EQ(rows.candidates()[0].precision, Precision::float32);
  EXPECT_GT(rows.observe(0).worst, 2 * u32);
}

TEST(Recommend, ToleranceBelowTheRoundoffOfFloat32TakesFloat64) {
  const Recommendation some = advice_for(test::chain(1, 7), 1e-11);
  EXPECT_EQ(some.precision, Precision::float64) << some.reason;
  EXPECT_TRUE(some.enough) << some.reason;
}

// Whose rows of float32 climb.
TEST(Recommend, HeavyTipTakesFloat64) {
  const Recommendation some = advice_for(heavy_tip(1e10), 1e-9);
  EXPECT_EQ(some.precision, Precision::float64);
  EXPECT_TRUE(some.enough) << some.reason;
}

TEST(Recommend, NothingIsEnoughForASingularMechanism) {
  const Recommendation some = advice_for(heavy_tip(0), 1e-2);
  EXPECT_FALSE(some.enough);
  EXPECT_EQ(some.predicted, HUGE_VAL);
}

TEST(Recommend, WrongSizesAreRefused) {
  const RobotModel model = kalmarm::plain(test::chain(1, 3));
  const std::vector<double> three(3), four(4), none;
  EXPECT_THROW(recommend(model, three, four, three), std::invalid_argument);
  EXPECT_THROW(recommend(model, none, none, none), std::invalid_argument);
}

}  // namespace
}  // namespace kalmarm
