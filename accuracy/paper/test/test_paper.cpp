// The table of the paper is complete, true, and finds the errors that are known.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "accuracy/measures/real.hpp"
#include "accuracy/paper/equations.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm {
namespace {

struct Checked {
  Scene scene;
  State state;
  std::vector<Row> rows;

  template <class T>
  static Checked in(const Model<double>& model, std::uint64_t seed) {
    Checked out{generated_scene("test", model), {}, {}};
    out.state = random_states(out.scene, 1, seed).front();
    const Soundness sound = soundness<T>(model, out.state);
    EXPECT_FALSE(sound.flaw);
    EXPECT_TRUE(sound.outcome);
    out.rows = check_paper<T>(model, out.state, model, out.state);
    return out;
  }
};

std::set<std::string> misprints(const std::vector<Row>& rows) {
  std::set<std::string> out;
  for (const Row& row : rows)
    if (!(row.printed <= 1e-6)) out.insert(row.equation.id);
  return out;
}

TEST(Paper, EveryNumberAndResultIsInARow) {
  const Digits digits(60);
  const Checked checked = Checked::in<double>(random_chain(4, 1, 4), 1);
  const int numbers[] = {0, 7, 11, 14, 11, 7, 4};  // (1.1) … (1.7), (2.1) … (2.11), and so on
  std::map<std::string, int> rows, results;
  for (const Row& row : checked.rows) {
    ++rows[row.equation.id];
    ++results[row.equation.result];
    EXPECT_FALSE(row.equation.statement.empty()) << row.equation.id;
    EXPECT_EQ(row.equation.corrected.empty(), row.equation.note.empty()) << row.equation.id;
    if (row.equation.id.front() == '(') {
      EXPECT_EQ(row.equation.id.substr(1, 1), row.section) << row.equation.id;
    }
  }
  for (int section = 1; section <= 6; ++section)
    for (int i = 1; i <= numbers[section]; ++i) {
      char id[32];
      std::snprintf(id, sizeof id, "(%d.%d)", section, i);
      EXPECT_EQ(rows[id], 1) << id;
    }
  for (const char* result : {"Result 3.1", "Result 3.2", "Result 3.3", "Result 3.4", "Result 3.5",
                             "Result 5.1", "Result 5.2", "Result 5.3", "Result 5.4", "Result 6.1"})
    EXPECT_GE(results[result], 1) << result;
}

class Mechanism : public testing::TestWithParam<const char*> {
 protected:
  static Model<double> model() {
    const std::string name = GetParam();
    if (name == "chain") return random_chain(6, 2, 4);
    if (name == "one_link") return random_chain(1, 3, 4);
    if (name == "tree") return random_tree(13, 4, 4);
    return load_scene(name).model;
  }
};

TEST_P(Mechanism, CorrectedFormsHoldInFiftyDigits) {
  const Digits digits(50);
  for (const Row& row : Checked::in<Real>(model(), 5).rows)
    EXPECT_LE(row.residual, 1e-45) << row.equation.id;
}

TEST_P(Mechanism, CorrectedFormsHoldInFloat64) {
  const Digits digits(60);
  for (const Row& row : Checked::in<double>(model(), 6).rows)
    EXPECT_LE(row.residual, 1e-10) << row.equation.id;
}

INSTANTIATE_TEST_SUITE_P(Models, Mechanism,
                         testing::Values("chain", "one_link", "tree", "puma560", "panda"),
                         [](const auto& info) { return std::string(info.param); });

TEST(Errata, AreTheKnownOnesOnAChainInMotion) {
  const Digits digits(60);
  const Checked checked = Checked::in<double>(random_chain(6, 7, 4), 8);
  EXPECT_EQ(
      misprints(checked.rows),
      (std::set<std::string>{"M(k)", "(2.4)", "(3.5)", "(3.7)", "(3.12)", "(4.1)", "(4.2)", "(4.3)",
                             "(4.11)", "(5.1)", "(5.2)", "(5.5)", "(6.1)", "(6.2)"}));
  for (const Row& row : checked.rows)
    EXPECT_EQ(row.equation.corrected.empty(), row.printed <= 1e-6) << row.equation.id;
}

TEST(Errata, OfTheBiasVanishWithoutIt) {  // at rest, without gravity, b = 0
  const Digits digits(60);
  const Model<double> chain = random_chain(6, 9, 4);
  std::vector<Joint<double>> joints;
  for (int k = 0; k < chain.nv(); ++k) joints.push_back(chain.joint(k));
  const Model<double> weightless(joints, chain.names(), chain.nq(), Vector3<double>::Zero());
  State state = random_states(generated_scene("test", weightless), 1, 10).front();
  state.qd.setZero();
  EXPECT_EQ(misprints(check_paper<double>(weightless, state, weightless, state)),
            (std::set<std::string>{"M(k)", "(3.5)", "(3.7)", "(3.12)", "(4.11)", "(5.2)", "(5.5)",
                                   "(6.1)", "(6.2)"}));
}

TEST(Beyond, BranchesThatDoNotActOnEachOtherHold) {  // entries of M^-1 between them are zero
  const Eigen::Quaterniond turned(0.3, -0.7, 0.2, 0.9), next_axis(1, 1, 1, 1);
  std::vector<Joint<double>> joints;
  for (const auto& rotation : {turned, next_axis, Eigen::Quaterniond(next_axis * next_axis)}) {
    Joint<double> joint;
    joint.parent = joints.empty() ? -1 : 0;
    joint.slides = true;
    joint.coordinate = Coordinate::distance;
    joint.q_index = static_cast<int>(joints.size());
    joint.rotation = rotation;
    joint.body = {2, {0.1, 0.2, 0.3}, {1, 0, 0, 0}, {0.1, 0.2, 0.2}};
    joints.push_back(joint);
  }
  const Model<double> slides(joints, {"x", "y", "z"}, 3, Vector3<double>(0, 0, -9.81));
  const Digits digits(60);
  for (const Row& row : Checked::in<double>(slides, 11).rows)
    EXPECT_LE(row.residual, 1e-10) << row.equation.id;
}

TEST(Residual, IsRelativeToTheRightSide) {
  const Eigen::Vector2d a(3, 4), b(6, 8), zero(0, 0);
  EXPECT_DOUBLE_EQ(residual(a, b), 0.5);
  EXPECT_DOUBLE_EQ(residual(b, a), 1);
  EXPECT_DOUBLE_EQ(residual(a, zero), 5);  // nothing to be relative to
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(worst({1, nan, 2})));
  EXPECT_EQ(worst({1, 3, 2}), 3);
}

}  // namespace
}  // namespace kalmarm
