// Islands: what they take from others, and that it does not matter in which order.
#include <gtest/gtest.h>

#include <deque>
#include <nlohmann/json.hpp>

#include "accuracy/adversary/island.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/test/temporary_file.hpp"

namespace kalmarm::adversary {
namespace {

using nlohmann::json;

const Provenance made{"program", "compiler", "flags", "isa", "blas"};

Island island(std::uint64_t seed) { return {{{"Sequential<Conventional>", "float32"}, seed}, 1}; }

// Rounds of genomes whose numbers are all the same, and their values.
std::vector<Round> of(const std::vector<double>& values) {
  std::vector<Round> out;
  for (const double value : values) {
    Round& round = out.emplace_back();
    round.best = {2, std::vector<double>(length_of(2), value)};
    round.value = value;
    round.evaluations = 10;
    round.curve = {{3, value}};
  }
  return out;
}

double first_number(const Genome& genome) { return genome.x[0]; }

class Islands : public testing::Test {
 protected:
  std::string record(const std::vector<double>& values, std::uint64_t seed = 1) {
    return island_record(island(seed), made, of(values), *judge_);
  }

  // Of the genomes that are taken from such files.
  std::vector<double> taken(const std::vector<std::string>& records,
                            const Provenance& by = made) const {
    std::deque<TemporaryFile> files;
    std::vector<std::string> paths;
    for (const std::string& text : records)
      paths.push_back(files.emplace_back(text, ".json").path());
    std::vector<double> out;
    for (const Round& round : immigrants(paths, island(9), by, first_number)) {
      EXPECT_EQ(round.evaluations, 0);
      EXPECT_EQ(round.value, first_number(round.best));
      out.push_back(round.value);
    }
    return out;
  }

  std::unique_ptr<Judge> judge_ = make_judge(island(1).asked.of);
};

TEST_F(Islands, TakeTheBestOfAllWhateverTheOrder) {
  const std::string a = record({0.1, 0.6, 0.3}, 1), b = record({0.5, 0.2, 0.6, 0.4}, 2),
                    c = record({0.25}, 3);
  const std::vector<double> best{0.6, 0.5, 0.4, 0.3, 0.25};
  EXPECT_EQ(taken({a, b, c}), best);
  EXPECT_EQ(taken({c, b, a}), best);
  EXPECT_EQ(taken({}), std::vector<double>());
}

TEST_F(Islands, RecordWhatWasFoundAndWhen) {
  const json written = json::parse(record({0.1, 0.6, 0.3}, 7));
  EXPECT_EQ(written["unit"], json({{"seed", 7}, {"evaluations", 1}}));
  EXPECT_EQ(written["evaluations"], 30);
  EXPECT_EQ(written["curve"], json({{3, 0.1}, {13, 0.6}}));
  ASSERT_EQ(written["best"].size(), 3u);
  EXPECT_EQ(written["best"][0]["value"], 0.6);
  EXPECT_FALSE(written["key"]["search"].contains("seed"));
}

TEST_F(Islands, RefuseWhatIsNoneOrAnothers) {
  json good = json::parse(record({0.1}));
  EXPECT_EQ(taken({good.dump()}).size(), 1u);
  EXPECT_THROW(taken({good.dump().substr(0, 100)}), InputError);
  EXPECT_THROW(taken({"{}"}), InputError);
  EXPECT_THROW(taken({"[]"}), InputError);
  EXPECT_THROW(taken({good.dump()}, {"another", "compiler", "flags", "isa", "blas"}), InputError);
  for (const auto& [pointer, value] :
       std::vector<std::pair<const char*, json>>{{"/version", 2},
                                                 {"/key/search/task", "inverse"},
                                                 {"/best/0/bodies", 3},
                                                 {"/best/0/bodies", 2.5},
                                                 {"/best/0/x/0", 1.5},
                                                 {"/best/0/x/0", nullptr},
                                                 {"/best", 3},
                                                 {"/best", json(6, good["best"][0])}}) {
    json bad = good;
    bad[json::json_pointer(pointer)] = value;
    EXPECT_THROW(taken({bad.dump()}), InputError) << pointer;
  }
}

}  // namespace
}  // namespace kalmarm::adversary
