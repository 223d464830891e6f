// The search on planted objectives, and on what it is for.
#include <gtest/gtest.h>

#include <cmath>

#include "accuracy/adversary/judge.hpp"
#include "accuracy/adversary/record.hpp"
#include "accuracy/adversary/search.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm::adversary {
namespace {

constexpr int planted_bodies = 2;

// Largest, 0, where every number of two bodies is 0.3; other numbers of bodies are far worse.
double planted(const Genome& genome) {
  double square = 0;
  for (const double x : genome.x) square += (x - 0.3) * (x - 0.3);
  return -square / static_cast<double>(genome.x.size()) - std::abs(genome.bodies - planted_bodies);
}

std::vector<Round> rounds(const Objective& objective, const Effort& effort, std::uint64_t seed,
                          int count, std::vector<Round> done = {}) {
  while (static_cast<int>(done.size()) < count)
    done.push_back(next_round(objective, effort, seed, done));
  return done;
}

// On a slide a wrist with a finger, and a load beside it.
Scene hand() {
  const TemporaryFile file(R"(<mujoco><worldbody><body>
    <joint type="slide" armature="0.25"/><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
    <body pos="0 3 4"><joint type="ball"/>
      <inertial pos="0 0 0" mass="1.2345e-8" diaginertia="1 1 1"/>
      <body pos="1 0 0"><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
    </body>
    <body pos="0 0 2"><joint/><inertial pos="0 0 0" mass="7000" diaginertia="1 1 1"/></body>
  </body></worldbody></mujoco>)",
                           ".xml");
  return load_scene(file.path());
}

void expect_equal(const std::vector<Round>& a, const std::vector<Round>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].best.bodies, b[i].best.bodies);
    EXPECT_EQ(a[i].best.x, b[i].best.x);
    EXPECT_EQ(a[i].value, b[i].value);
    EXPECT_EQ(a[i].evaluations, b[i].evaluations);
    EXPECT_EQ(a[i].curve, b[i].curve);
  }
}

TEST(AdversarySearch, FindsAPlantedOptimumThatRandomSamplingDoesNot) {
  const Effort effort;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const std::vector<Round> found = rounds(planted, effort, seed, 6);
    const std::vector<Round> random = rounds(planted, {effort.sum(), 0, 0}, seed, 6);
    EXPECT_EQ(best_of(found).best.bodies, planted_bodies);
    EXPECT_LT(-best_of(found).value, 0.2 * -best_of(random).value) << seed;
  }
}

TEST(AdversarySearch, ValuesAreThoseOfTheirGenomes) {
  for (const Round& round : rounds(planted, {50, 50, 100}, 4, 4)) {
    EXPECT_EQ(round.value, planted(round.best));
    EXPECT_EQ(round.curve.back().second, round.value);
    EXPECT_EQ(round.evaluations, 200);
    for (std::size_t i = 1; i < round.curve.size(); ++i)
      EXPECT_LT(round.curve[i - 1], round.curve[i]);
  }
}

TEST(AdversarySearch, TheSameSeedGivesTheSameRoundsAndAnotherOthers) {
  const Effort little{30, 30, 60};
  const auto one = rounds(planted, little, 5, 4), again = rounds(planted, little, 5, 4),
             other = rounds(planted, little, 6, 4);
  expect_equal(one, again);
  EXPECT_NE(one[0].best.x, other[0].best.x);
}

TEST(AdversarySearch, GoesOnAfterAnInterruptionAsIfThereHadBeenNone) {
  const Effort little{30, 30, 60};
  const Asked asked{{"Ladder<default>", "float64"}, 7};
  const TemporaryFile file(to_json(asked, rounds(planted, little, 7, 3)), ".json");
  expect_equal(rounds(planted, little, 7, 6),
               rounds(planted, little, 7, 6, read_rounds(file.path(), asked)));
  EXPECT_THROW(read_rounds(file.path(), {{"Ladder<default>", "float32"}, 7}), InputError);
  EXPECT_THROW(read_rounds(file.path(), {{"Ladder<default>", "float64", Want::inverse}, 7}),
               InputError);
  EXPECT_TRUE(read_rounds(file.path() + ".not-there", asked).empty());
  const TemporaryFile half(to_json(asked, rounds(planted, little, 7, 1)).substr(0, 300), ".json");
  EXPECT_THROW(read_rounds(half.path(), asked), InputError);
}

TEST(AdversarySearch, RoundsOfWhichAByteWasChangedAreRefused) {
  const Asked asked{{"Ladder<default>", "float64"}, 7};
  const std::string text = to_json(asked, rounds(planted, {30, 30, 60}, 7, 1));
  for (std::size_t i = 0; i + 1 < text.size(); i += 5) {  // the last ends the line
    std::string changed = text;
    changed[i] = changed[i] == '1' ? '2' : '1';
    const TemporaryFile file(changed, ".json");
    EXPECT_THROW(read_rounds(file.path(), asked), InputError) << i;
  }
}

TEST(AdversarySearch, FindsSilentErrorsOfTheConventionalFormInFloat32) {
  const auto judge = make_judge({"Sequential<Conventional>", "float32"});
  const Objective objective = [&](const Genome& genome) {
    return judge->look(decode(genome)).value(Goal::error, usual_condition);
  };
  const Round found = best_of(rounds(objective, {30, 30, 60}, 1, 2));
  EXPECT_GT(found.value, -2);  // 1 %
  const Verdict verdict = judge->look(decode(found.best));
  EXPECT_TRUE(verdict.silent());
  EXPECT_EQ(verdict.value(Goal::error, usual_condition), found.value);
}

TEST(AdversaryRecord, RowsAreTheBestSoFarAndTheMechanism) {
  const Asked asked{{"Sequential<UD>", "float32"}, 3};
  Round first, second;
  first.evaluations = second.evaluations = 100;
  first.curve = {{1, -22.5}, {5, -7}, {80, -3}};
  second.curve = {{2, -8}, {9, -2}, {10, -1.99}};
  first.value = -3, second.value = -1.99;
  Verdict verdict;
  verdict.kS = 1.5;
  EXPECT_EQ(
      csv_rows(asked, {first, second}, verdict, hand().model, "x"),
      "Sequential<UD>,float32,acceleration,error,spatial,0,3,search,5,9.9999999999999995e-08,,,,\n"
      "Sequential<UD>,float32,acceleration,error,spatial,0,3,search,80,0.001,,,,\n"
      "Sequential<UD>,float32,acceleration,error,spatial,0,3,search,109,0.01,,,,\n"
      "Sequential<UD>,float32,acceleration,error,spatial,0,3,search,200,0.010232929922807542,1.5,6,"
      "x," +
          outline(hand().model) + '\n');
  EXPECT_EQ(asked.slug(), "Sequential-UD-float32-search-3");
}

TEST(AdversaryRecord, SaysWhatWasAskedWhereItIsNotTheUsual) {
  const Asked asked{
      {"Ladder<last_bits>", "float64", Want::log_det, Goal::claim, Kernel::translational, true},
      4,
      false};
  EXPECT_EQ(asked.slug(), "Ladder-last-bits-float64-log-det-claim-translational-rows-random-4");
  Round round;
  round.evaluations = 10;
  EXPECT_EQ(csv_rows(asked, {round}, {}, {}, ""),
            "Ladder<last_bits>,float64,log_det,claim,translational,1,4,random,10,,,,,\n");
}

TEST(AdversaryRecord, OutlineHasEachBodyOnce) {
  EXPECT_EQ(outline(hand().model),
            "0 slide 2 0 0.25;1 ball 1.23e-08 5 0;2 hinge 1 1 0;1 hinge 7e+03 2 0");
  EXPECT_EQ(outline({}), "");
}

}  // namespace
}  // namespace kalmarm::adversary
