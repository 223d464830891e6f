#include "accuracy/adversary/island.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

#include "accuracy/adversary/search_json.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/json_file.hpp"

namespace kalmarm::adversary {
namespace {

using nlohmann::json;

constexpr const char* format = "kalmarm island";
constexpr int version = 1;

json key_of(const Island& island, const Provenance& made) {
  json search = asked_json(island.asked);
  search.erase("seed");
  return {{"program", made.program}, {"compiler", made.compiler}, {"flags", made.flags},
          {"isa", made.isa},         {"blas", made.blas},         {"search", search}};
}

// The best first, of equal values by their numbers; no genome twice.
std::vector<Round> ranked(std::vector<Round> rounds) {
  const auto same = [](const Round& a, const Round& b) {
    return a.best.bodies == b.best.bodies && a.best.x == b.best.x;
  };
  std::ranges::sort(rounds, [](const Round& a, const Round& b) {
    if (a.value != b.value) return a.value > b.value;
    if (a.best.bodies != b.best.bodies) return a.best.bodies < b.best.bodies;
    return a.best.x < b.best.x;
  });
  rounds.erase(std::unique(rounds.begin(), rounds.end(), same), rounds.end());
  if (rounds.size() > emigrants) rounds.resize(emigrants);
  return rounds;
}

json or_null(double x) { return std::isnan(x) ? json() : json(x); }

}  // namespace

std::vector<Round> immigrants(const std::vector<std::string>& files, const Island& island,
                              const Provenance& made, const Objective& objective) {
  std::vector<Round> out;
  for (const std::string& file : files) {
    const json document = read_json(file);
    try {
      if (document.at("format") != format || document.at("version") != version)
        throw InputError("is no island of this version");
      if (document.at("key") != key_of(island, made))
        throw InputError("is of another search, or of another program");
      if (document.at("best").size() > emigrants) throw InputError("has too many genomes");
      for (const json& entry : document.at("best")) {
        Round& round = out.emplace_back();
        round.best = genome_of(entry);
        round.value = objective(round.best);
      }
    } catch (const std::exception& e) {
      throw InputError(file + ": " + e.what());
    }
    out = ranked(std::move(out));
  }
  return out;
}

std::string island_record(const Island& island, const Provenance& made,
                          const std::vector<Round>& rounds, Judge& judge) {
  json best = json::array(), curve = json::array();
  for (const Round& round : ranked(rounds)) {
    const Mechanism mechanism = decode(round.best, island.asked.of.kernel);
    const Verdict verdict = judge.look(mechanism);
    best.push_back({{"bodies", round.best.bodies},
                    {"x", round.best.x},
                    {"value", round.value},
                    {"error", or_null(verdict.error)},
                    {"excess", or_null(verdict.excess)},
                    {"kS", or_null(verdict.kS)},
                    {"nv", mechanism.model.nv()}});
  }
  int before = 0;
  double so_far = told;
  for (const Round& round : rounds) {
    for (const auto& [evaluations, value] : round.curve)
      if (value > so_far) curve.push_back({before + evaluations, so_far = value});
    before += round.evaluations;
  }
  const json out = {{"format", format},
                    {"version", version},
                    {"key", key_of(island, made)},
                    {"unit", {{"seed", island.asked.seed}, {"evaluations", island.evaluations}}},
                    {"evaluations", before},
                    {"best", best},
                    {"curve", curve}};
  return out.dump() + '\n';
}

}  // namespace kalmarm::adversary
