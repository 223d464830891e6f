// Units by name, and what they show, whoever works at it.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "accuracy/stress/measure_unit.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::stress {
namespace {

using nlohmann::json;

std::string read_again(const std::string& name) { return unit_of(name, families()).name(); }

TEST(Unit, IsItsName) {
  for (const char* name : {"wild/1/1+20000", "coaxial/0/5+1", "heavy_tip/1e+16/0+3",
                           "wild/1/0+999999999999999", "straight/1e+03/2+2"})
    EXPECT_EQ(read_again(name), name);
  EXPECT_EQ(read_again("wild/1.0/01+2"), "wild/1/1+2");
}

TEST(Unit, RefusesWhatIsNone) {
  for (const char* name : {"",
                           "wild",
                           "wild/1",
                           "wild/1/1",
                           "wild/1/1+",
                           "wild/1/+1",
                           "wild//1+1",
                           "/1/1+1",
                           "wild/1/1+1/2",
                           "wild/1/1+1+1",
                           "wild/1/-1+1",
                           "wild/1/1+-1",
                           "wild/1/1.5+1",
                           "wild/1/1+1e3",
                           "wild/x/1+1",
                           "wild/1 /1+1",
                           " wild/1/1+1",
                           "wild/0x1/1+1",
                           "wild/1/1+0",
                           "wild/1/1+999999999999999",
                           "wild/1/99999999999999999999+1",
                           "wild/1/1+99999999999999999999",
                           "wilder/1/1+1",
                           "wild/2/1+1",
                           "wild/nan/1+1",
                           "wild/inf/1+1",
                           "straight/-3/1+1"})
    EXPECT_THROW((void)unit_of(name, families()), InputError) << name;
}

const Campaign asked{{"Ladder<last_bits>", "Sequential<Conventional>"},
                     {"float32", "float64"},
                     {"dynamics", "white"},
                     3};

json measured(const std::string& name) {
  const Unit unit = unit_of(name, families());
  return json::parse(unit_record(unit, asked, {"program", "compiler", "flags", "isa", "blas"},
                                 measure_unit(unit, asked, [](const auto&...) {})));
}

void add(std::map<std::string, std::uint64_t>& sums, const std::string& name, const json& value) {
  if (value.is_object())
    for (const auto& [key, inner] : value.items()) add(sums, name + '/' + key, inner);
  else
    sums[name] += value.get<std::uint64_t>();
}

// Every count of every group.
std::map<std::string, std::uint64_t> sums(const std::vector<json>& units) {
  std::map<std::string, std::uint64_t> out;
  for (const json& unit : units)
    for (const json& group : unit["groups"]) {
      std::string name;
      for (const char* key : {"task", "variant", "precision", "measure", "kS", "mass_ratio"})
        name += group[key].dump();
      for (const char* counts : {"status", "recomputed", "errors", "beyond_claim"})
        if (group.contains(counts)) add(out, name + counts, group[counts]);
    }
  std::erase_if(out, [](const auto& count) { return count.second == 0; });
  return out;
}

TEST(Unit, CountsOfPartsAreThoseOfTheWhole) {
  const json whole = measured("wild/1/3+6");
  EXPECT_EQ(sums({measured("wild/1/3+2"), measured("wild/1/5+4")}), sums({whole}));
  EXPECT_EQ(measured("wild/1/3+6").dump(), whole.dump());

  std::map<std::string, std::uint64_t> ok;
  for (const json& group : whole["groups"])
    ok[group["measure"]] += group["status"].value("ok", std::uint64_t(0));
  EXPECT_EQ(ok["relative"], ok["energy"]);
  EXPECT_GT(ok["relative"], 40u);  // 6 mechanisms, 2 tasks, variants and precisions
  EXPECT_EQ(whole["mechanisms"], 6);
}

TEST(Unit, KeepsTheWorstOfEachSeriesInOrder) {
  std::map<std::string, std::vector<std::pair<double, int>>> series;
  std::vector<double> errors;
  const json unit = measured("wild/1/3+6");
  for (const json& found : unit["worst"]) {
    const double error = std::stod(found["error"].get<std::string>());
    errors.push_back(-error);
    series[found["task"].dump() + found["variant"].dump() + found["precision"].dump()].emplace_back(
        -error, found["seed"]);
  }
  EXPECT_TRUE(std::ranges::is_sorted(errors));
  EXPECT_EQ(series.size(), 8u);
  for (const auto& [name, kept] : series) EXPECT_EQ(kept.size(), 3u) << name;
}

TEST(Unit, LeavesOutWhatHasNoTruth) {
  const json none = measured("coaxial/0/1+3");
  EXPECT_EQ(none["no_truth"], json({{"singular", 3}}));
  EXPECT_EQ(none["groups"], json::array());
  EXPECT_EQ(none["worst"], json::array());
  EXPECT_EQ(none["mechanisms"], 3);
  EXPECT_EQ(measured("mass_unit/1e+40/1+2")["no_truth"], json({{"range", 2}}));  // in float32
}

}  // namespace
}  // namespace kalmarm::stress
