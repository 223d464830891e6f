// The worst that searches have found, committed (found/README.md): today's variants err there as
// they did or less, and the recommended one is right or says that it is not.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "accuracy/adversary/judge.hpp"
#include "accuracy/limits/judge.hpp"
#include "robots/state_file.hpp"

namespace kalmarm::adversary {
namespace {

const std::string folder = KALMARM_FOUND_DIR;

struct Found {
  std::string variant, precision, file;
  double error;
};

double right(const std::string& precision) { return precision == "float32" ? 1e-2 : 1e-6; }

std::vector<Found> all_found() {
  std::vector<Found> out;
  for (const auto& row : nlohmann::json::parse(std::ifstream(folder + "/found.json")))
    out.push_back({row["variant"], row["precision"], row["file"], row["error"]});
  return out;
}

Verdict look(const Found& found, const std::string& variant) {
  const std::string base = folder + '/' + found.file;
  const Scene scene = load_scene(base + ".xml");
  const State state = read_states(scene, base + ".json").states.at(0);
  return make_judge(variant, found.precision)->look({scene.model, state});
}

TEST(AdversaryFound, VariantsErrAsTheyDidOrAreRightOrSaySo) {
  for (const Found& found : all_found()) {
    SCOPED_TRACE(found.file);
    const Verdict verdict = look(found, found.variant);
    if (!verdict.silent()) continue;
    ASSERT_TRUE(verdict.known);
    if (verdict.error <= right(found.precision)) continue;
    EXPECT_LT(verdict.error, 2 * found.error);
    EXPECT_GT(verdict.error, found.error / 2);
  }
}

TEST(AdversaryFound, TheRecommendedVariantIsRightOrWarns) {
  for (const Found& found : all_found()) {
    SCOPED_TRACE(found.file);
    const Verdict verdict = look(found, limits::recommended_variant);
    if (!verdict.silent()) continue;
    ASSERT_TRUE(verdict.known);
    EXPECT_LE(verdict.error, right(found.precision));
  }
}

}  // namespace
}  // namespace kalmarm::adversary
