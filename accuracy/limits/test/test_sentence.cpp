// The sentence follows the numbers: made-up ones.
#include <gtest/gtest.h>

#include "accuracy/limits/sentence.hpp"

namespace kalmarm::limits {
namespace {

// Errors of fast, Cholesky, certified in float32, then in float64; negative: refused.
using Errors = std::vector<double>;

const Errors good = {2e-6, 1e-4, 1e-7, 1e-14, 1e-13, 1e-16};
const Errors heavy = {1e-3, 1e-1, 1e-7, 2e-11, 1e-9, 1e-16};

Swept swept(const std::string& range, const std::vector<std::pair<double, Errors>>& at) {
  Swept out;
  out.stress.range = range;
  for (const auto& [value, errors] : at) {
    out.values.push_back(value);
    Found found;
    for (const double error : errors)
      found.tallies.push_back({.worst = error, .refused = error < 0 ? 5 : 0, .states = 5});
    out.found[0].push_back(found);
    for (Tally& tally : found.tallies)
      if (tally.worst > 0) tally.worst /= 100;  // the other task is harmless
    out.found[1].push_back(found);
  }
  return out;
}

Swept given(const Errors& errors) { return swept("", {{1, errors}}); }

const std::string payload = "with up to {} times the mass of hand on it";

TEST(Sentence, NothingGoesWrong) {
  EXPECT_EQ(sentence_of({given(good), swept(payload, {{1, good}, {1e8, good}})}),
            "float32 is right to 5 digits in every pose and under every stress searched");
}

TEST(Sentence, ALimitIsTheLastValueBeforeTheFirstThatFails) {
  const Swept load = swept(payload, {{1, good}, {3000, good}, {5000, heavy}, {1e4, good}});
  EXPECT_EQ(values_kept(load, {0, 5}), 2u);
  EXPECT_EQ(sentence_of({given(good), load}),
            "float32 is right to 5 digits in every pose searched, with up to 3000 times the mass "
            "of hand on it; beyond that take float64, right to 10 digits in all that was searched");
}

TEST(Sentence, AStressThatIsToldIsNamedWhereItIsNoLimit) {
  Swept gain = swept("by steps with gains up to {} N m/rad", {{1, good}, {1e9, good}});
  const Swept load = swept(payload, {{1, good}, {10, heavy}});
  EXPECT_EQ(sentence_of({given(good), gain}),
            "float32 is right to 5 digits in every pose and under every stress searched");
  gain.stress.told = true;
  EXPECT_EQ(sentence_of({given(good), gain}),
            "float32 is right to 5 digits in every pose and under every stress searched, by steps "
            "with gains up to 1e9 N m/rad");
  EXPECT_EQ(sentence_of({given(good), load, gain}),
            "float32 is right to 5 digits in every pose searched, with up to 1 times the mass of "
            "hand on it, by steps with gains up to 1e9 N m/rad; beyond that take float64, right to "
            "10 digits in all that was searched");
  gain = swept("by steps with gains up to {} N m/rad", {{1, good}, {1e3, good}, {1e6, heavy}});
  gain.stress.told = true;
  EXPECT_EQ(sentence_of({given(good), gain}),
            "float32 is right to 5 digits in every pose searched, by steps with gains up to 1000 "
            "N m/rad; beyond that take float64, right to 10 digits in all that was searched");
}

TEST(Sentence, EveryLimitIsNamed) {
  const Swept load = swept(payload, {{1, good}, {10, heavy}});
  const Swept wrist = swept("with wrist down to {} of its mass", {{0.01, good}, {1e-4, heavy}});
  const Swept base = swept("with base down to {} of its mass", {{1e-2, heavy}});
  const std::string sentence = sentence_of({given(good), load, wrist, base});
  EXPECT_NE(sentence.find(", with up to 1 times the mass of hand on it and with wrist down to 0.01 "
                          "of its mass, but not with base down to 0.01 of its mass;"),
            std::string::npos)
      << sentence;
}

TEST(Sentence, ARefusalIsNotRight) {
  Errors refused = good;
  refused[0] = -1;
  EXPECT_EQ(digits_kept(given(refused), 0, 0), 0);
  EXPECT_EQ(values_kept(swept(payload, {{1, good}, {10, refused}}), {0, 5}), 1u);
}

TEST(Sentence, OnlyStressesThatAreLimitsDecideWhatIsTakenBeyond) {
  Errors worse = heavy;
  worse[0] = 2e-6;
  worse[3] = 1e-3;
  const Swept harmless = swept("", {{1, good}, {0.1, worse}});
  const std::string sentence =
      sentence_of({given(good), swept(payload, {{1, good}, {10, heavy}}), harmless});
  EXPECT_TRUE(sentence.ends_with("beyond that take float64")) << sentence;
}

TEST(Sentence, TheCertifiedFormIsTakenWhereNoOtherIsRight) {
  Errors extreme = heavy;
  extreme[3] = 1e-3;
  EXPECT_NE(sentence_of({given(good), swept(payload, {{1, good}, {10, extreme}})})
                .find("; beyond that take float64 to the last bits"),
            std::string::npos);
}

TEST(Sentence, ThePromiseIsWhatTheGivenRobotKeeps) {
  Errors four = good, bad = good, worst = good;
  four[0] = 5e-5;
  EXPECT_EQ(promise_of(given(four)).digits, 4);
  bad[0] = 0.02;
  EXPECT_EQ(
      sentence_of({given(bad)}),
      "float32 keeps 1 digit of the robot as given; float64 is right to 9 digits in every pose "
      "and under every stress searched");  // it has 14, and 9 are promised
  bad[3] = -1;
  EXPECT_EQ(promise_of(given(bad)).contender, 5);
  for (double& error : worst) error = 0.5;
  EXPECT_EQ(sentence_of({given(worst)}),
            "even as given, no form is right to 3 digits in every pose searched");
}

TEST(Sentence, WhereNothingHelpsItSaysSo) {
  const Errors hopeless(6, 0.5);
  EXPECT_NE(sentence_of({given(good), swept(payload, {{1, good}, {10, hopeless}})})
                .find("; beyond that no form is right to as many"),
            std::string::npos);
}

TEST(Sentence, ValuesBetweenGoFromOneToTheOther) {
  EXPECT_EQ(values_between(1000, 1e4), std::vector<double>({2000, 3000, 5000}));
  EXPECT_EQ(values_between(1, 1e-2).size(), 7u);
  EXPECT_DOUBLE_EQ(values_between(1, 1e-2)[0], 0.5);
  EXPECT_DOUBLE_EQ(values_between(1, 1e-2)[6], 0.02);
  EXPECT_TRUE(values_between(1e-4, 0).empty());
}

}  // namespace
}  // namespace kalmarm::limits
