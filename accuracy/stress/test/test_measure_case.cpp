// What stands in a record: of a mechanism whose answer is known, of a singular one, of variants
// that belong together.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>

#include "accuracy/stress/measure_case.hpp"
#include "accuracy/stress/selection.hpp"
#include "robots/scene/generate.hpp"

namespace kalmarm::stress {
namespace {

using Row = std::map<std::string, std::string>;

std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      out.emplace_back();
    else
      out.back() += c;
  }
  return out;
}

std::vector<Row> rows(const std::string& csv) {
  std::string header = csv_header;
  header.pop_back();
  const std::vector<std::string> names = fields(header);
  std::vector<Row> out;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string> values = fields(line);
    if (values.size() != names.size()) throw std::runtime_error("columns of: " + line);
    Row& row = out.emplace_back();
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = values[i];
  }
  return out;
}

double number_in(const Row& row, const std::string& column) {
  const std::string& text = row.at(column);
  return text.empty() || text == "nan" ? std::nan("") : std::stod(text);
}

const Family& family(const std::string& name) {
  for (const Family& one : families())
    if (one.name == name) return one;
  throw std::runtime_error("no family " + name);
}

// Truth that these tests work out stays out of the user's cache.
class MeasureCase : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    setenv("KALMARM_CACHE", (testing::TempDir() + "test_measure_case").c_str(), 1);
  }

  std::vector<Row> measure(const Family& of, double value, const std::string& precision,
                           const Selection& selection = {}) {
    return rows(csv_rows(of, value, 1, precision,
                         measure_case(of.make(value, 1), 1, precision, selection)));
  }
};

// A mass of `value` kg that falls along z: M = value, M^-1 = 1/value, a = -9.81.
Family one_slide() {
  Family out;
  out.name = "one, \"slide\"";
  out.make = [](double value, std::uint64_t) {
    Joint<double> joint;
    joint.slides = true;
    joint.coordinate = Coordinate::distance;
    joint.body = {value, {0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}};
    return Case{assemble({joint}, {0, 0, -9.81}), VectorX<double>::Zero(1),
                VectorX<double>::Zero(1)};
  };
  return out;
}

TEST_F(MeasureCase, KnowsAFallingMass) {
  for (const auto& [precision, u] : {std::pair{"float32", 0x1p-24}, {"float64", 0x1p-53}}) {
    SCOPED_TRACE(precision);
    const std::vector<Row> all = measure(one_slide(), 4, precision);
    std::map<std::string, int> tasks;
    for (const Row& row : all) {
      SCOPED_TRACE(row.at("variant") + ' ' + row.at("task"));
      ++tasks[row.at("task")];
      EXPECT_EQ(row.at("family"), "one, slide");  // the quotes are CSV's
      EXPECT_EQ(row.at("n"), "1");
      EXPECT_EQ(row.at("status"), "ok");
      EXPECT_EQ(row.at("warning"), "");
      EXPECT_EQ(number_in(row, "kappa"), 1);
      EXPECT_EQ(number_in(row, "kappa_scaled"), 1);
      EXPECT_LE(number_in(row, "relative"), 3 * u);
      const double eta = number_in(row, "relative") / (u * number_in(row, "kS"));
      if (row.at("eta") != "") {
        EXPECT_NEAR(number_in(row, "eta"), eta, 1e-3 * eta);
      }
      if (row.at("task") != "factors") continue;
      EXPECT_EQ(number_in(row, "relative"), 0);  // D = m, and its root is exact
      EXPECT_EQ(number_in(row, "P_constraint"), 0);
      EXPECT_EQ(number_in(row, "P_asymmetry"), 0);
    }
    for (const char* task :
         {"random", "white", "consistent", "free_fall", "dynamics", "inverse", "factors"})
      EXPECT_GT(tasks[task], 0) << task;
  }
}

// Conventional loses about log10 of the mass ratio, and the square root does not.
TEST_F(MeasureCase, SeesWhatAVariantLoses) {
  const Selection selection{{"Sequential<Conventional>", "FactoredBias<ArrayGivens>"},
                            {"dynamics"}};
  const std::vector<Row> all = measure(family("heavy_tip"), 1e10, "float64", selection);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_GT(number_in(all[0], "relative"), 1e-10);
  EXPECT_LT(number_in(all[1], "relative"), 1e-13);
  EXPECT_GT(number_in(all[0], "kappa"), 1e10);
}

TEST_F(MeasureCase, PutsTheErrorBeforeRefinementNextToTheRefined) {
  const std::vector<Row> all = measure(family("heavy_tip"), 1e6, "float32");
  std::map<std::pair<std::string, std::string>, std::string> error;
  for (const Row& row : all) error[{row.at("variant"), row.at("task")}] = row.at("relative");
  int refined = 0;
  for (const Row& row : all) {
    const std::string& name = row.at("variant");
    const std::size_t begin = name.find("Refined<");
    EXPECT_EQ(row.at("steps") != "", row.at("estimate") != "") << name;
    if (begin == std::string::npos) continue;
    const std::string inner = name.substr(begin + 8, name.size() - begin - 9);
    EXPECT_EQ(row.at("unrefined"), (error[{inner, row.at("task")}])) << name;
    ++refined;
  }
  EXPECT_GT(refined, 20);
}

TEST_F(MeasureCase, HasNoErrorWhereThereIsNoAnswer) {
  const std::vector<Row> all = measure(family("coaxial"), 0, "float64", {{}, {"random"}});
  EXPECT_FALSE(all.empty());
  for (const Row& row : all) {
    EXPECT_EQ(row.at("relative"), "") << row.at("variant");
    if (row.at("variant").starts_with("Sequential<")) {
      EXPECT_EQ(row.at("status"), "singular");
    }
  }
}

TEST_F(MeasureCase, LeavesOutMatricesOfLongChains) {
  const std::vector<Row> all = measure(family("straight"), largest_inverse + 1, "float64",
                                       {{"StackedQR", "FactoredBias<ArrayGivens>"}, {}});
  EXPECT_FALSE(all.empty());
  for (const Row& row : all) {
    EXPECT_EQ(row.at("variant"), "FactoredBias<ArrayGivens>");
    EXPECT_NE(row.at("task"), "inverse");
    EXPECT_EQ(row.at("kappa"), "");
    EXPECT_NE(row.at("relative"), "");
  }
}

TEST(Select, TakesNamesAndBeginnings) {
  const std::vector<std::string> known = {"heavy_tip", "heavy_base", "tree"};
  EXPECT_EQ(select({"heavy_*"}, known, "family"),
            (std::vector<std::string>{"heavy_tip", "heavy_base"}));
  EXPECT_EQ(select({"tree"}, known, "family"), std::vector<std::string>{"tree"});
  EXPECT_ANY_THROW(select({"three"}, known, "family"));
  EXPECT_ANY_THROW(select({"x*"}, known, "family"));
}

}  // namespace
}  // namespace kalmarm::stress
