// The worst that searches have found, committed (found/README.md): today's variants err there as
// they did or less, and the certified form is right or says that it is not.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "accuracy/adversary/record.hpp"
#include "robots/state_file.hpp"

namespace kalmarm::adversary {
namespace {

const std::string folder = KALMARM_FOUND_DIR, certified = "Fast<Certified>";

struct Found {
  std::string variant, precision, file;
  double error;
};

// Of wrong digits nothing is left but their size: another compiler or processor rounds otherwise.
constexpr double rounded_otherwise = 100;

double right(const std::string& precision) { return precision == "float32" ? 1e-2 : 1e-6; }

// The rows that adversary --csv ends a search with; no field is quoted.
std::vector<Found> all_found() {
  std::vector<Found> out;
  std::ifstream file(folder + "/found.csv");
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line + '\n', csv_header);
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::vector<std::string> fields;
    for (std::string field; std::getline(row, field, ',');) fields.push_back(field);
    out.push_back({fields.at(0), fields.at(1), fields.at(8), std::stod(fields.at(5))});
  }
  return out;
}

Verdict look(const Found& found, const std::string& variant) {
  const std::string base = folder + '/' + found.file;
  const Scene scene = load_scene(base + ".xml");
  const State state = read_states(scene, base + ".json").states.at(0);
  return make_judge(variant, found.precision)->look({scene.model, state});
}

TEST(AdversaryFound, EveryVariantHasItsWorstInBothPrecisions) {
  std::map<std::string, int> cases;
  for (const Found& found : all_found()) ++cases[found.variant];
  EXPECT_GE(cases.size(), 7);
  for (const auto& [variant, count] : cases) EXPECT_EQ(count, 2) << variant;
}

TEST(AdversaryFound, VariantsErrAsTheyDidOrAreRightOrSaySo) {
  for (const Found& found : all_found()) {
    SCOPED_TRACE(found.file);
    const Verdict verdict = look(found, found.variant);
    if (!verdict.silent()) continue;
    ASSERT_TRUE(verdict.known);
    if (verdict.error <= right(found.precision)) continue;
    EXPECT_LT(verdict.error, rounded_otherwise * found.error);
    EXPECT_GT(verdict.error, found.error / rounded_otherwise);
  }
}

TEST(AdversaryFound, TheCertifiedFormIsRightOrWarnsWhereOthersAreWorst) {
  for (const Found& found : all_found()) {
    if (found.variant == certified) continue;
    SCOPED_TRACE(found.file);
    const Verdict verdict = look(found, certified);
    if (!verdict.silent()) continue;
    ASSERT_TRUE(verdict.known);
    EXPECT_LE(verdict.error, right(found.precision));
  }
}

}  // namespace
}  // namespace kalmarm::adversary
