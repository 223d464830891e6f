// limits: how far a robot is from trouble. What may happen to it (stresses.hpp) is searched for the
// worst states (search.hpp); digits that are left by form and precision, and one sentence.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>

#include "accuracy/limits/campaign.hpp"
#include "accuracy/limits/sentence.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"

namespace kalmarm::limits {
namespace {

using nlohmann::json;

constexpr int largest = 100;  // DoF: truth is worked out for hundreds of states
constexpr std::array precisions = {"float32", "float64"};

struct Options {
  std::string scene, json_file;
  LoadOptions read;
  std::uint64_t seed = 1;
  double effort = 1;
};

// As `evaluate --states` reads them.
json worst_state(const Found& found, const Tally& tally) {
  if (tally.worst_state < 0) return {};
  const State& state = found.states[tally.worst_state];
  const auto values = [](const VectorX<double>& x) { return std::vector(x.begin(), x.end()); };
  return {{"qpos", values(state.q)}, {"qvel", values(state.qd)}, {"tau", values(state.tau)}};
}

json curve(const std::vector<Found>& found, std::size_t contender) {
  json out = {{"variant", variants[contender % variants.size()]},
              {"precision", precisions[contender / variants.size()]}};
  for (const char* key : {"worst", "worst_state", "refused", "warnings", "silent", "states"})
    out[key] = json::array();
  for (const Found& at : found) {
    const Tally& tally = at.tallies[contender];
    out["worst"].push_back(tally.worst < 0 ? json() : json(tally.worst));
    out["worst_state"].push_back(worst_state(at, tally));
    out["refused"].push_back(tally.refused);
    out["warnings"].push_back(tally.warned);
    out["silent"].push_back(tally.silent);
    out["states"].push_back(tally.states);
  }
  return out;
}

// The value up to which the promise holds.
json kept(const Swept& swept, const Promise& promise) {
  const std::size_t count = values_kept(swept, promise);
  return count > 0 ? json(swept.values[count - 1]) : json();
}

json described(const Swept& swept, const Promise& promise) {
  json out = {{"name", swept.stress.name},
              {"title", swept.stress.title},
              {"unit", swept.stress.unit},
              {"values", swept.values},
              {"kept", kept(swept, promise)}};
  for (std::size_t task = 0; task < tasks.size(); ++task) {
    json& curves = out["tasks"][to_string(tasks[task])] = json::array();
    for (std::size_t i = 0; i < precisions.size() * variants.size(); ++i)
      curves.push_back(curve(swept.found[task], i));
  }
  return out;
}

// "5.3", digits left; "-" where it refused every state, "5.3*" where it refused some.
std::string digits_left(const json& entry, std::size_t i) {
  if (entry["worst"][i].is_null()) return "-";
  char text[16];
  const double digits = -std::log10(std::max(entry["worst"][i].get<double>(), 1e-20));
  std::snprintf(text, sizeof text, "%.1f", std::max(0.0, digits));
  return text + std::string(entry["refused"][i] > 0 ? "*" : "");
}

void print_stress(const json& stress) {
  const std::string title = stress["title"], unit = stress["unit"];
  std::printf("\n%s%s%s\n", title.c_str(), unit.empty() ? "" : ", ", unit.c_str());
  const json& values = stress["values"];
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::printf("%9s", unit.empty() ? "" : short_value(values[i]).c_str());
    for (const auto& [task, curves] : stress["tasks"].items()) {
      std::printf("  ");
      for (const json& entry : curves) std::printf(" %5s", digits_left(entry, i).c_str());
    }
    std::printf("\n");
  }
}

void print(const json& out) {
  std::printf(
      "%s: digits left in the worst states of %d that were searched; * where some were "
      "refused, - where all\n\n",
      out["robot"].get<std::string>().c_str(), out["evaluations"].get<int>());
  std::printf("%9s  %-36s  %s\n%9s", "", "acceleration", "inverse", "");
  for (std::size_t task = 0; task < tasks.size(); ++task)
    std::printf("   %-18s%-17s", precisions[0], precisions[1]);
  std::printf("\n%9s", "");
  for (std::size_t task = 0; task < tasks.size(); ++task) {
    std::printf("  ");
    for (std::size_t i = 0; i < precisions.size(); ++i)
      for (const char* form : {"dflt", "chol", "last"}) std::printf(" %5s", form);
  }
  std::printf("\n");
  for (const json& stress : out["stresses"]) print_stress(stress);
  std::printf("\ndflt, chol, last: %s, %s, %s\n", variants[0], variants[1], variants[2]);
  std::printf("\n%s\n", out["sentence"].get<std::string>().c_str());
}

Effort scaled(Effort effort, double factor) {
  for (int* states : {&effort.random, &effort.global, &effort.local, &effort.random_float64,
                      &effort.local_float64})
    *states = std::max(1, static_cast<int>(factor * *states));
  return effort;
}

int run(const Options& options) {
  const auto begin = std::chrono::steady_clock::now();
  const Scene scene = open_scene(options.scene, options.read);
  const int nv = scene.model.nv();
  if (nv > largest)
    throw InputError("scene '" + options.scene + "' has " + std::to_string(nv) +
                     " degrees of freedom; states are searched for up to " +
                     std::to_string(largest));
  OutputFile file = json_output(options.json_file);
  std::vector<Swept> all;
  {
    Progress progress(most_searches(stresses_of(scene)));
    std::mutex one_at_a_time;
    all = search_all(scene, scaled(effort_for(nv), options.effort), options.seed,
                     [&](const std::string& what) {
                       const std::lock_guard lock(one_at_a_time);
                       progress.step(what);
                     });
  }
  json out = {{"robot", scene.name}, {"nv", nv}, {"sentence", sentence_of(all)}};
  const Promise promise = promise_of(all[0]);
  if (promise.contender >= 0)
    out["promise"] = {{"variant", variants[promise.contender % variants.size()]},
                      {"precision", precisions[promise.contender / variants.size()]},
                      {"digits", promise.digits}};
  out["stresses"] = json::array();
  int evaluations = 0;
  for (const Swept& swept : all) {
    out["stresses"].push_back(described(swept, promise));
    for (const std::vector<Found>& found : swept.found)
      for (const Found& at : found) evaluations += at.evaluations;
  }
  out["evaluations"] = evaluations;
  out["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (options.json_file != "-") print(out);
  file.write(out.dump() + "\n");
  return 0;
}

}  // namespace
}  // namespace kalmarm::limits

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app(
      "Digits that are left in a robot's worst states: as given, loaded, without armature, with a "
      "light wrist, a long tool, a light first link.",
      "limits");
  limits::Options options;
  add_scene(app, options.scene, options.read)->required();
  app.add_option("--seed", options.seed, "of the random states and of the search")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--effort", options.effort, "states that are searched, times the usual number")
      ->check(between(1e-3, 1e3))
      ->capture_default_str();
  app.add_option("--json", options.json_file, std::string("the result: ") + json_help);
  return run_program(app, argc, argv, [&] { return limits::run(options); });
}
