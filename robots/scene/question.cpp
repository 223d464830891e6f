#include "robots/scene/question.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

#include "algorithms/model/plain.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/names.hpp"
#include "robots/scene/sites.hpp"

namespace kalmarm {
namespace {

// DoF of one joint or, with several DoF, of all that have its name before a colon.
std::vector<int> dofs_of(const Model<double>& model, const std::string& pattern) {
  std::vector<int> out;
  for (int k = 0; k < model.nv(); ++k)
    if (matches(pattern, model.name(k)) || matches(pattern + ":*", model.name(k))) out.push_back(k);
  if (out.empty()) throw InputError(unknown_name("joint", pattern, model.names()));
  return out;
}

// The first DoF of k's joint, and the one after its last. A free joint's translations and its
// rotations are apart: MuJoCo's order has no marks between, but either may be locked.
std::pair<int, int> joint_of(const Model<double>& model, int k) {
  int first = k, end = k + 1;
  while (model.joint(first).coordinate == Coordinate::follower) --first;
  while (end < model.nv() && model.joint(end).coordinate == Coordinate::follower &&
         model.parent(end) == end - 1)
    ++end;
  return {first, end};
}

std::vector<int> sorted(std::vector<int> x) {
  std::sort(x.begin(), x.end());
  x.erase(std::unique(x.begin(), x.end()), x.end());
  return x;
}

void refuse_parts_of_joints(const Model<double>& model, const std::vector<int>& locked) {
  for (const int k : locked) {
    const auto [first, end] = joint_of(model, k);
    for (int i = first; i < end; ++i)
      if (!std::binary_search(locked.begin(), locked.end(), i))
        throw InputError("joint '" + model.name(k) + "' is locked, but '" + model.name(i) +
                         "' of the same joint is not");
  }
}

// Locks what `given` says, JOINT or JOINT=VALUE. values: of DoF to which one was given.
void lock(const Model<double>& model, const std::string& given, Question& question,
          std::map<int, double>& values) {
  const std::size_t equals = given.rfind('=');
  const std::vector<int> dofs = dofs_of(model, given.substr(0, equals));
  question.locked.insert(question.locked.end(), dofs.begin(), dofs.end());
  if (equals == std::string::npos) return;
  const std::string text = given.substr(equals + 1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw InputError("--locked " + given + ": '" + text + "' is not a finite number");
  for (const int k : dofs) {
    const Coordinate coordinate = model.joint(k).coordinate;
    if (coordinate != Coordinate::angle && coordinate != Coordinate::distance)
      throw InputError("--locked " + given + ": '" + model.name(k) +
                       "' is of a joint of several degrees of freedom, which takes no value");
    const auto [at, first] = values.emplace(k, value);
    if (!first && at->second != value)
      throw InputError("--locked: '" + model.name(k) + "' is locked at two values");
    question.q[model.joint(k).q_index] = value;
  }
}

std::optional<Want> want_of(const std::string& word) {
  for (const Want want : {Want::acceleration, Want::inverse, Want::diagonal, Want::log_det,
                          Want::mass, Want::operational})
    if (word == to_string(want)) return want;
  return std::nullopt;
}

std::vector<Frame> named_frames(const Scene& scene, const std::vector<std::string>& names) {
  std::vector<Frame> out;
  if (names.empty()) return out;
  const std::vector<NamedSite> known = sites_of(scene);
  for (const std::string& name : names) {
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&](const NamedSite& site) { return site.name == name; });
    if (found == known.end()) {
      std::vector<std::string> all;
      for (const NamedSite& site : known) all.push_back(site.name);
      throw InputError(unknown_name("site, body or link", name, all));
    }
    out.push_back(plain(found->site));
  }
  return out;
}

}  // namespace

namespace {

// One word a time, A,B: the SCENE that may follow is no value.
CLI::Option* list(CLI::App& app, const char* name, std::vector<std::string>& values,
                  const char* help) {
  return app.add_option(name, values, help)->delimiter(',')->allow_extra_args(false);
}

}  // namespace

void QuestionOptions::add_parts_to(CLI::App& app) {
  list(
      app, "--dofs", dofs,
      "joints that are asked about (patterns such as 'left_*', ? for a comma in a name); else all");
  list(app, "--site", sites,
       "sites, bodies or links of J M^-1 J' (want operational), 6 rows each; plan --frames lists "
       "them");
  auto* const lock = list(app, "--locked", locked,
                          "joints that stand still, JOINT or JOINT=VALUE [rad or m]; patterns");
  list(app, "--free", free, "the only joints that are not locked")->excludes(lock);
  app.add_flag("--at-rest", at_rest, "velocities are zero");
}

void QuestionOptions::add_to(CLI::App& app) {
  add_parts_to(app);
  auto* const off = app.add_flag("--no-pruning", no_pruning, "leave nothing out, to compare");
  list(app, "--without", without, "rules that are not to be used")->excludes(off);
}

Question question_of(const Scene& scene, const QuestionOptions& options) {
  const Model<double>& model = scene.model;
  Question out;
  for (const std::string& word : options.want)
    if (const std::optional<Want> want = want_of(word)) out.want.insert(*want);
  out.at_rest = options.at_rest;
  const VectorX<double> home = home_position(scene);
  out.q.assign(home.begin(), home.end());

  std::map<int, double> values;
  for (const std::string& given : options.locked) lock(model, given, out, values);
  if (!options.free.empty()) {
    std::vector<char> free(model.nv(), 0);
    for (const std::string& pattern : options.free)
      for (const int k : dofs_of(model, pattern)) free[k] = 1;
    for (int k = 0; k < model.nv(); ++k)
      if (!free[k]) out.locked.push_back(k);
  }
  out.locked = sorted(std::move(out.locked));
  refuse_parts_of_joints(model, out.locked);
  if (static_cast<int>(out.locked.size()) == model.nv())
    throw InputError("every joint is locked: nothing can move");

  for (const std::string& pattern : options.dofs) {
    const std::vector<int> dofs = dofs_of(model, pattern);
    out.dofs.insert(out.dofs.end(), dofs.begin(), dofs.end());
  }
  out.dofs = sorted(std::move(out.dofs));
  for (const int k : out.dofs)
    if (std::binary_search(out.locked.begin(), out.locked.end(), k))
      throw InputError("joint '" + model.name(k) + "' is asked about (--dofs) and locked");
  if (!out.dofs.empty() && out.want.contains(Want::log_det))
    throw InputError("log det M is of all joints that are free: --dofs does not go with it");

  out.frames = named_frames(scene, options.sites);
  out.loaded = named_frames(scene, options.loaded);
  if (out.want.contains(Want::operational) && out.frames.empty())
    throw InputError("--want operational needs --site");
  if (!out.want.contains(Want::operational) && !out.frames.empty())
    throw InputError("--site is for --want operational, which is not asked for");
  return out;
}

std::set<Rule> rules_of(const QuestionOptions& options) {
  if (options.no_pruning) return {};
  std::set<Rule> out = all_rules();
  std::vector<std::string> names;
  for (const Rule rule : all_rules()) names.push_back(to_string(rule));
  for (const std::string& name : options.without)
    if (std::erase_if(out, [&](Rule rule) { return to_string(rule) == name; }) == 0 &&
        std::find(names.begin(), names.end(), name) == names.end())
      throw InputError(unknown_name("rule", name, names));
  return out;
}

State asked_state(const Scene& scene, const Question& question, State state) {
  for (const int k : question.locked) {
    const int first = scene.model.joint(k).q_index,
              count = q_entries(scene.model.joint(k).coordinate);
    std::copy_n(question.q.begin() + first, count, state.q.begin() + first);
    state.qd[k] = 0;
  }
  if (question.at_rest) state.qd.setZero();
  return state;
}

State checked_state(const Scene& scene, const Question& question, const State& state,
                    const std::string& where) {
  const State asked = asked_state(scene, question, state);
  for (int k = 0; k < scene.model.nv(); ++k) {
    const int first = scene.model.joint(k).q_index,
              count = q_entries(scene.model.joint(k).coordinate);
    if (count > 0 && (asked.q.segment(first, count) - state.q.segment(first, count)).norm() > 1e-9)
      throw InputError(where + "joint '" + scene.model.name(k) + "' is locked at " +
                       std::to_string(asked.q[first]) + ", but qpos[" + std::to_string(first) +
                       "] = " + std::to_string(state.q[first]));
    if (asked.qd[k] != state.qd[k])
      throw InputError(where + "joint '" + scene.model.name(k) +
                       "' is locked or at rest, but qvel[" + std::to_string(k) +
                       "] = " + std::to_string(state.qd[k]));
  }
  return asked;
}

}  // namespace kalmarm
