#include "accuracy/stress/measure_unit.hpp"

#include <cmath>
#include <cstdio>
#include <exception>
#include <new>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "accuracy/truth/truth.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::stress {
namespace {

using nlohmann::json;

// Those whose Outcome::error is the error of the answer, and no estimate in another norm.
std::set<std::string> claiming_variants() {
  std::set<std::string> out;
  for (const auto& variant : registered_variants<double>())
    if (variant.traits.refined) out.insert(variant.name);
  return out;
}

// Why the mechanism has no truth in one of the precisions; else empty, and all are measured.
std::string measure_mechanism(const Case& c, std::uint64_t seed, const Campaign& campaign,
                              std::vector<Measurement>& measured) {
  const Selection selection{campaign.variants, campaign.tasks, false};
  measured.clear();
  try {
    for (const std::string& precision : campaign.precisions) {
      measured.push_back(measure_case(c, seed, precision, selection));
      if (const Outcome& truth = measured.back().truth; !truth) return to_string(truth.status);
    }
  } catch (const NoTruth& e) {
    return e.why == NoTruth::Why::digits ? "digits" : "range";
  }
  return "";
}

json or_null(double x) { return std::isnan(x) ? json() : json(x); }

json or_null(const std::optional<int>& x) { return x ? json(*x) : json(); }

json written(const ErrorCounts& counts) {
  json bins = json::object();
  for (const auto& [bin, count] : counts.bins) bins[std::to_string(bin)] = count;
  return {{"zero", counts.zero}, {"nan", counts.nan}, {"inf", counts.inf}, {"bins", bins}};
}

json written(const Unit& unit, const Group& group, const Counts& counts) {
  json out = {{"family", unit.family->name},
              {"value", unit.value},
              {"task", group.task},
              {"variant", group.variant},
              {"precision", group.precision},
              {"measure", group.measure},
              {"kS", or_null(group.kS)},
              {"mass_ratio", or_null(group.mass_ratio)},
              {"status", counts.status},
              {"recomputed", counts.recomputed},
              {"errors", {{"silent", written(counts.silent)}, {"warned", written(counts.warned)}}}};
  if (counts.beyond_claim) out["beyond_claim"] = *counts.beyond_claim;
  return out;
}

json written(const Unit& unit, const WorstCase& found) {
  char error[32];
  std::snprintf(error, sizeof error, "%a", found.error);
  return {{"family", unit.family->name},
          {"value", unit.value},
          {"seed", found.seed},
          {"task", found.task},
          {"variant", found.variant},
          {"precision", found.precision},
          {"error", error},
          {"kS", or_null(found.kS)},
          {"mass_ratio", or_null(found.mass_ratio)}};
}

}  // namespace

Tally measure_unit(const Unit& unit, const Campaign& campaign, const Seen& seen) {
  Tally tally(claiming_variants(), campaign.worst);
  std::vector<Measurement> measured;
  for (std::uint64_t seed = unit.first; seed < unit.first + unit.count; ++seed) {
    try {
      const Case c = unit.family->make(unit.value, seed);
      if (const std::string why = measure_mechanism(c, seed, campaign, measured); !why.empty()) {
        tally.leave_out(why);
        continue;
      }
      for (std::size_t i = 0; i < measured.size(); ++i) {
        tally.add(seed, mass_ratio(c.model), campaign.precisions[i], measured[i]);
        seen(measured[i], campaign.precisions[i], seed);
      }
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& e) {  // of millions, which one?
      throw InputError("seed " + std::to_string(seed) + ": " + e.what());
    }
  }
  return tally;
}

std::string unit_record(const Unit& unit, const Campaign& campaign, const Provenance& made,
                        const Tally& tally) {
  json groups = json::array(), worst = json::array();
  for (const auto& [group, counts] : tally.groups()) groups.push_back(written(unit, group, counts));
  for (const WorstCase& found : tally.worst()) worst.push_back(written(unit, found));
  json out = {{"format", "kalmarm unit"},
              {"version", 2},
              {"key",
               {{"program", made.program},
                {"campaign",
                 {{"variants", campaign.variants},
                  {"precisions", campaign.precisions},
                  {"tasks", campaign.tasks},
                  {"worst", campaign.worst}}},
                {"compiler", made.compiler},
                {"flags", made.flags},
                {"isa", made.isa},
                {"blas", made.blas}}},
              {"unit",
               {{"family", unit.family->name},
                {"value", unit.value},
                {"first", unit.first},
                {"count", unit.count}}},
              {"mechanisms", unit.count},
              {"no_truth", tally.left_out()}};
  out["groups"] = std::move(groups);
  out["worst"] = std::move(worst);
  return out.dump() + '\n';
}

}  // namespace kalmarm::stress
