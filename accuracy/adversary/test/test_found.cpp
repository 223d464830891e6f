// The worst that searches have found, committed (found/README.md): no variant errs there by more
// than it did, and the ladder to its last bits is right or says that it is not.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "accuracy/adversary/record.hpp"
#include "algorithms/model/plain.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/scene/state_file.hpp"

namespace kalmarm::adversary {
namespace {

const std::string folder = KALMARM_FOUND_DIR, certified = "Ladder<last_bits>",
                  conventional = "Ladder<default>";

struct Found {
  Case asked;
  std::string file;
  double error;  // of a search against claims, over what was claimed
};

// Of wrong digits nothing is left but their size: another compiler or processor rounds otherwise.
constexpr double rounded_otherwise = 100;

Want task_of(const std::string& name) {
  for (const Want task : tasks())
    if (to_string(task) == name) return task;
  throw std::runtime_error("no task is called " + name);
}

Kernel kernel_of(const std::string& name) {
  for (const Kernel kernel : {Kernel::spatial, Kernel::translational, Kernel::spatial_at_rest})
    if (to_string(kernel) == name) return kernel;
  throw std::runtime_error("no kernel is called " + name);
}

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
    const Goal goal = fields.at(3) == "claim" ? Goal::claim : Goal::error;
    EXPECT_EQ(fields.at(3), to_string(goal));
    const Kernel kernel = kernel_of(fields.at(4));
    const bool rows = fields.at(5) == "1";
    out.push_back({{fields.at(0), fields.at(1), task_of(fields.at(2)), goal, kernel, rows},
                   fields.at(12),
                   std::stod(fields.at(9))});
  }
  return out;
}

Verdict look(const Found& found, const std::string& variant) {
  const std::string base = folder + '/' + found.file;
  const Scene scene = load_scene(base + ".xml");
  const State state = read_states(scene, base + ".json").states.at(0);
  Case asked = found.asked;
  asked.variant = variant;
  return make_judge(asked)->look({scene.model, state});
}

TEST(AdversaryFound, EveryVariantHasItsWorstInBothPrecisions) {
  std::set<std::string> variants;
  std::set<std::pair<std::string, std::string>> cases;
  for (const Found& found : all_found()) {
    variants.insert(found.asked.variant);
    cases.insert({found.asked.variant, found.asked.precision});
  }
  EXPECT_GE(variants.size(), 7);
  EXPECT_EQ(cases.size(), 2 * variants.size());
}

TEST(AdversaryFound, NoVariantErrsInSilenceByMoreThanItDid) {
  for (const Found& found : all_found()) {
    SCOPED_TRACE(found.file);
    const Verdict verdict = look(found, found.asked.variant);
    if (!verdict.silent()) continue;
    ASSERT_TRUE(verdict.known);
    const double promised = promise(found.asked.precision);
    const bool library = found.asked.variant == certified || found.asked.variant == conventional;
    EXPECT_LE(verdict.error,
              library ? promised / 5 : std::max(promised, rounded_otherwise * found.error));
  }
}

TEST(AdversaryFound, TheCertifiedFormErrsByNoMoreThanFourTimesWhatItSays) {
  int claims = 0;
  for (const Found& found : all_found()) {
    SCOPED_TRACE(found.file);
    const Verdict verdict = look(found, certified);
    if (!verdict.silent() || !verdict.claims()) continue;
    ASSERT_TRUE(verdict.known);
    EXPECT_LE(verdict.excess, 4);
    ++claims;
  }
  EXPECT_GT(claims, 10);
}

// Rows have kernels of their own: of float32, lanes answer nothing else.
TEST(AdversaryFound, RowsKeepAFifthOfThePromise) {
  int rows = 0;
  for (const Found& found : all_found()) {
    if (found.asked.variant != conventional) continue;
    SCOPED_TRACE(found.file);
    Found in_rows = found;
    in_rows.asked.rows = true;
    const Verdict verdict = look(in_rows, conventional);
    ++rows;
    if (!verdict.silent()) continue;
    ASSERT_TRUE(verdict.known);
    EXPECT_LE(verdict.error, promise(found.asked.precision) / 5);
  }
  EXPECT_GE(rows, 12);
}

// What shows that files and states are still those that were found: nobody mends plain filters.
TEST(AdversaryFound, TheStudysFiltersStillErrThere) {
  int filters = 0;
  for (const Found& found : all_found()) {
    if (!found.asked.variant.starts_with("Sequential<")) continue;
    SCOPED_TRACE(found.file);
    const Verdict verdict = look(found, found.asked.variant);
    ++filters;
    ASSERT_TRUE(verdict.silent() && verdict.known);
    EXPECT_GT(verdict.error, found.error / rounded_otherwise);
  }
  EXPECT_GE(filters, 6);
}

TEST(AdversaryFound, TheCertifiedFormIsRightOrWarnsWhereOthersAreWorst) {
  for (const Found& found : all_found()) {
    if (found.asked.variant == certified) continue;
    SCOPED_TRACE(found.file);
    const Verdict verdict = look(found, certified);
    if (!verdict.silent()) continue;
    ASSERT_TRUE(verdict.known);
    EXPECT_LE(verdict.error, promise(found.asked.precision));
  }
}

}  // namespace
}  // namespace kalmarm::adversary
