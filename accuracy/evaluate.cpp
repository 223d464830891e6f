// evaluate: one variant on given or random states -> JSON.
//
// What the question does not need is left out (pruning/plan.hpp), unless --no-pruning says so.
// "asked" names the DoF of the results where these are not all, "sites" those of J M^-1 J'.
//
// A variant that answers but warns (outcome.hpp) says so in the state: "warning", with the joint
// and its numbers, "error_estimate" and "refinement_steps" where it has them, "widened" where it
// was refined by factors of a wider precision. `--variant auto` chooses (recommend.hpp); a state
// that it had to give to another variant names it.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "accuracy/plan_loss.hpp"
#include "accuracy/real.hpp"
#include "algorithms/pruning/answer.hpp"
#include "robots/mujoco_solver.hpp"
#include "robots/program.hpp"
#include "robots/question.hpp"
#include "robots/scene.hpp"
#include "robots/state_file.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

struct Options {
  std::string scene, variant, precision, states, out;
  QuestionOptions question;
  int random = 0, digits = 50;
  double tolerance = 1e-6;
  std::uint64_t seed = 1;
  bool list = false;
};

constexpr const char* mujoco_variant = "MuJoCo";
constexpr const char* automatic = "auto";

template <class T>
json to_json(const VectorX<T>& x) {
  json out = json::array();
  for (const T& entry : x) out.push_back(static_cast<double>(entry));
  return out;
}

template <class T>
json to_json(const MatrixX<T>& X) {
  json rows = json::array();
  for (int i = 0; i < X.rows(); ++i) rows.push_back(to_json<T>(VectorX<T>(X.row(i))));
  return rows;
}

[[noreturn]] void unknown_variant(const Options& options, const std::string& why) {
  std::string names = mujoco_variant;
  for (const auto& variant : registered_variants<double>()) names += ", " + variant.name;
  throw InputError("variant '" + options.variant + "' " + why + " (known: " + names + ")");
}

template <class T>
std::unique_ptr<Solver<T>> make_contender(const Options& options, const Scene& scene,
                                          const Part& part, const Model<T>& model) {
  if (options.variant == mujoco_variant) {
    if constexpr (std::is_same_v<T, double>)
      return std::make_unique<MujocoSolver>(mujoco_of(scene));
    else
      unknown_variant(options, "has no precision " + options.precision);
  }
  if (auto solver = solvers_of<T>(options.variant)(part, model)) return solver;
  for (const auto& variant : registered_variants<double>())
    if (variant.name == options.variant)
      unknown_variant(options, "has no precision " + options.precision);
  unknown_variant(options, "is unknown");
}

std::string place(const Scene& scene, std::size_t state) {
  return scene.name + ": state " + std::to_string(state) + ": ";
}

std::string at_joint(const Outcome& outcome, const Scene& scene) {
  char text[96];
  std::snprintf(text, sizeof text, ", D = %.3g against a scale of %.3g", outcome.D, outcome.scale);
  return " at joint '" + scene.model.name(outcome.joint) + "'" + text;
}

// Of an outcome that failed or warns, in words.
std::string describe(const Outcome& outcome, const Scene& scene) {
  if (!outcome && outcome.joint < 0) return "the result is not finite";
  if (!outcome)
    return std::string("mass matrix ") + to_string(outcome.status) + at_joint(outcome, scene);
  if (outcome.near_singular) return "mass matrix nearly singular" + at_joint(outcome, scene);
  char text[64];
  std::snprintf(text, sizeof text, "the estimated error is %.2g", outcome.error);
  return text;
}

// What the outcome of a state adds to its JSON.
void add_outcome(const Outcome& outcome, const Scene& scene, json& entry) {
  if (outcome.near_singular)
    entry["warning"] = {{"kind", "near_singular"},
                        {"joint", scene.model.name(outcome.joint)},
                        {"D", outcome.D},
                        {"scale", outcome.scale}};
  else if (outcome.warns())
    entry["warning"] = {{"kind", "inaccurate"}};
  if (std::isnan(outcome.error)) return;
  entry["error_estimate"] = outcome.error;
  entry["refinement_steps"] = outcome.steps;
  if (outcome.widened) entry["widened"] = true;
}

// Of one state. Where the outcome is a failure the entry is not whole.
struct Result {
  json entry;
  Outcome outcome;

  // Keeps the first failure or warning, and the last estimate of the error. False on failure.
  bool take(Outcome next) {
    if (std::isnan(next.error)) {
      next.error = outcome.error;
      next.steps = outcome.steps;
      next.widened = outcome.widened;
    }
    if (!next || !outcome.near_singular) outcome = next;
    outcome.error = next.error;
    outcome.steps = next.steps;
    outcome.widened = next.widened;
    return bool(next);
  }
};

using Evaluator = std::function<Result(const State&)>;

template <class T>
class Evaluation {
 public:
  Evaluation(const Options& options, const Scene& scene, const Plan& plan)
      : want_(options.question.want.begin(), options.question.want.end()),
        answer_(std::make_shared<Answer<T>>(plan, [&](const Part& part, const Model<T>& model) {
          return make_contender<T>(options, scene, part, model);
        })) {
    if (options.variant == mujoco_variant)
      mujoco_ = std::make_shared<MujocoSolver>(mujoco_of(scene));
    if (!wants("factors")) return;
    if (options.question.selects()) throw InputError("factors are those of the whole robot");
    factored_ = make_contender<T>(options, scene, Part(), scene.model.cast<T>());
    if (!factored_->has_factors())
      throw InputError("variant '" + options.variant + "' has no factors D and g");
  }

  Result operator()(const State& state) {
    const VectorX<T> q = state.q.cast<T>(), qd = state.qd.cast<T>(), tau = state.tau.cast<T>();
    const int asked = answer_->nv(), nv = static_cast<int>(tau.size());
    Result out;
    out.entry = {
        {"qpos", to_json(state.q)}, {"qvel", to_json(state.qd)}, {"tau", to_json(state.tau)}};
    if (wants("mass")) out.entry["mass"] = to_json(mass(state.q, q));
    if (wants("inverse")) {
      MatrixX<T> X = poisoned(asked, asked);
      if (!out.take(answer_->inverse(q, X))) return out;
      out.entry["inverse"] = to_json(X);
    }
    if (wants("diagonal")) {
      VectorX<T> x = poisoned(asked, 1);
      if (!out.take(answer_->diagonal(q, x))) return out;
      out.entry["diagonal"] = to_json(x);
    }
    if (wants("log_det")) {
      T x = std::numeric_limits<T>::quiet_NaN();
      if (!out.take(answer_->log_det(q, x))) return out;
      out.entry["log_det"] = static_cast<double>(x);
    }
    if (wants("operational")) {
      MatrixX<T> X = poisoned(answer_->rows(), answer_->rows());
      if (!out.take(answer_->operational(q, X))) return out;
      out.entry["operational"] = to_json(X);
    }
    if (wants("acceleration")) {
      VectorX<T> a = poisoned(asked, 1);
      if (!out.take(answer_->acceleration(q, qd, tau, a))) return out;
      out.entry["acceleration"] = to_json(a);
    }
    if (wants("factors")) {
      VectorX<T> D = poisoned(nv, 1);
      MatrixX<T> g = poisoned(6, nv);
      if (!out.take(factored_->factors(q, D, g))) return out;
      out.entry["factors"] = {{"D", to_json(D)}, {"g", to_json<T>(MatrixX<T>(g.transpose()))}};
    }
    return out;
  }

 private:
  bool wants(const char* what) const { return want_.contains(what); }

  static MatrixX<T> poisoned(int rows, int columns) {
    return MatrixX<T>::Constant(rows, columns, std::numeric_limits<T>::quiet_NaN());
  }

  MatrixX<T> mass(const VectorX<double>& position, const VectorX<T>& q) {
    MatrixX<T> M = poisoned(answer_->nv(), answer_->nv());
    if (mujoco_) {
      MatrixX<double> theirs(M.rows(), M.cols());
      mujoco_->mass(position, theirs);
      return theirs.cast<T>();
    }
    answer_->mass(q, M);
    return M;
  }

  std::set<std::string> want_;
  std::shared_ptr<Answer<T>> answer_;     // shared: std::function wants to copy
  std::shared_ptr<Solver<T>> factored_;   // for the factors of the whole robot
  std::shared_ptr<MujocoSolver> mujoco_;  // for its M
};

Plan plan_of(const Options& options, const Scene& scene, const Question& question) {
  const std::set<Rule> able = rules_for(options.variant), given = rules_of(options.question);
  std::set<Rule> rules;
  std::set_intersection(able.begin(), able.end(), given.begin(), given.end(),
                        std::inserter(rules, rules.end()));
  if (options.variant == mujoco_variant) {
    if (!question.locked.empty()) throw InputError("variant 'MuJoCo' cannot lock joints");
    if (question.want.contains(Want::log_det))
      throw InputError("variant 'MuJoCo' has no log det M");
    rules.clear();
  }
  return make_plan(scene.model, question, rules);
}

Evaluator evaluator(const Options& options, const Scene& scene, const Question& question) {
  const Plan plan = plan_of(options, scene, question);
  if (options.precision == "float32") return Evaluation<float>(options, scene, plan);
  if (options.precision == "float64") return Evaluation<double>(options, scene, plan);
  return Evaluation<Real>(options, scene, plan);
}

// States of one kind, told in one line on stderr: the first of them, and how many there are.
class Note {
 public:
  void add(const std::string& text) {
    if (count_++ == 0) first_ = text;
  }

  void tell(const char* kind, std::size_t states) const {
    if (count_ > 0)
      std::fprintf(stderr, "evaluate: %s: %s (%d of %zu states)\n", kind, first_.c_str(), count_,
                   states);
  }

 private:
  std::string first_;
  int count_ = 0;
};

// What --variant auto uses, and what it goes on with where that fails or warns.
struct Automatic {
  Options chosen, recommended;

  bool leaves(const Outcome& outcome) const {
    return chosen.variant != recommended.variant && (!outcome || outcome.warns());
  }
};

std::string describe(const Loss& loss, const Request& request) {
  char text[128];
  if (request.acceleration)
    std::snprintf(text, sizeof text,
                  "lost, in roundoffs: %.2g by cancellation, %.2g by parameters, %.2g observed",
                  loss.cancellation, loss.parameters, loss.observed);
  else
    std::snprintf(text, sizeof text, "lost, in roundoffs: %.2g by cancellation, %.2g by Cholesky",
                  loss.cancellation, loss.cholesky);
  return text;
}

Automatic choose(const Options& options, const Scene& scene, const Question& question,
                 const std::vector<State>& states) {
  const std::set<std::string> want(options.question.want.begin(), options.question.want.end());
  if (want.contains("factors")) throw InputError("--variant auto gives no factors");
  if (options.precision == "mp") throw InputError("--variant auto is for float32 and float64");
  const bool acceleration = want.contains("acceleration");
  const Request request{acceleration, !acceleration || want.contains("inverse"), options.tolerance,
                        options.precision};
  const Loss loss =
      predict(make_plan(scene.model, question, {Rule::locked_joints}), request, states);
  const Choice choice = recommend(loss, request);
  std::fprintf(stderr,
               "evaluate: auto: %s in %s, predicted error %.1g %s the tolerance %.3g (%s)\n",
               choice.variant.c_str(), choice.precision.c_str(), choice.predicted,
               choice.predicted <= options.tolerance ? "within" : "BEYOND", options.tolerance,
               describe(loss, request).c_str());
  Automatic out{options, options};
  out.chosen.variant = choice.variant;
  out.chosen.precision = choice.precision;
  out.recommended.variant = recommended_variant;
  if (options.precision.empty()) out.recommended.precision = "float64";
  return out;
}

json evaluate(const Options& options, const std::optional<Automatic>& automatic, const Scene& scene,
              const Question& question, const std::vector<State>& states) {
  const Evaluator answer = evaluator(options, scene, question);
  const Evaluator again =
      automatic ? evaluator(automatic->recommended, scene, question) : Evaluator();
  Note warnings, changes, inaccurate;
  json out = json::array();
  {
    Progress progress(static_cast<int>(states.size()));
    for (const State& state : states) {
      const std::string where = place(scene, out.size());
      progress.step("state " + std::to_string(out.size()));
      const Options* by = &options;
      Result a = answer(state);
      if (automatic && automatic->leaves(a.outcome)) {
        changes.add(where + describe(a.outcome, scene) + "; went on with " +
                    automatic->recommended.variant);
        by = &automatic->recommended;
        a = again(state);
        a.entry["variant"] = by->variant;
        a.entry["precision"] = by->precision;
      }
      if (!a.outcome)
        throw InputError(where + describe(a.outcome, scene) + " (" + by->variant + ", " +
                         by->precision + ")");
      if (a.outcome.warns())
        warnings.add(where + describe(a.outcome, scene));
      else if (automatic && a.outcome.error > options.tolerance)
        inaccurate.add(where + describe(a.outcome, scene) + ", beyond the tolerance");
      add_outcome(a.outcome, scene, a.entry);
      out.push_back(std::move(a.entry));
    }
  }
  changes.tell("auto", states.size());
  warnings.tell("warning", states.size());
  inaccurate.tell("warning", states.size());
  return out;
}

int run(const Options& options) {
  if (options.list) {
    for (const auto& variant : registered_variants<double>())
      std::printf("%s\n", variant.name.c_str());
    std::printf("%s\n", mujoco_variant);
    return 0;
  }
  if (options.scene.empty()) throw InputError("SCENE is required");
  if (options.variant.empty()) throw InputError("--variant is required; --list prints them");
  if (options.out.empty()) throw InputError("--out is required");

  const Scene scene = load_scene(options.scene);
  const Question question = question_of(scene, options.question);
  std::vector<State> states;
  if (!options.states.empty()) {
    StateFile file = read_states(scene, options.states);
    if (file.normalized > 0)
      std::fprintf(stderr, "evaluate: note: %d quaternion(s) normalised in %s\n", file.normalized,
                   options.states.c_str());
    for (const State& state : file.states)
      states.push_back(checked_state(scene, question, state, place(scene, states.size())));
  } else {
    states = random_states(scene, options.random > 0 ? options.random : 1, options.seed);
    for (State& state : states) state = asked_state(scene, question, state);
  }

  std::optional<Automatic> choice;
  if (options.variant == automatic) choice = choose(options, scene, question, states);
  Options used = choice ? choice->chosen : options;
  if (used.precision.empty()) used.precision = "float64";
  const Digits digits(options.digits);
  json document = {{"robot", scene.name},
                   {"nv", scene.model.nv()},
                   {"dofs", scene.model.names()},
                   {"variant", used.variant},
                   {"precision", used.precision}};
  const Plan plan = plan_of(used, scene, question);
  if (static_cast<int>(plan.asked.size()) < scene.model.nv()) {
    for (const int k : plan.asked) document["asked"].push_back(scene.model.name(k));
  }
  if (!question.sites.empty()) document["sites"] = options.question.sites;
  document["states"] = evaluate(used, choice, scene, question, states);
  write_file(options.out, document.dump() + "\n");
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("One variant on given or random states: M, M^-1 and a = M^-1 (tau - bias) as JSON.",
               "evaluate");
  Options options;
  options.question.want = {"mass", "inverse", "acceleration"};
  app.add_option("SCENE", options.scene, scene_help);
  app.add_flag("--list", options.list, "print the variants, one a line");
  app.add_option("--variant", options.variant,
                 "e.g. 'Sequential<ArrayMGS>'; auto chooses for this robot and these states");
  app.add_option("--tolerance", options.tolerance, "error that auto may leave, relative")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--precision", options.precision,
                 "float32, float64 (default) or mp (multi-precision)")
      ->check(CLI::IsMember({"float32", "float64", "mp"}));
  app.add_option("--digits", options.digits, "decimal digits of mp")
      ->check(CLI::Range(20, 10000))
      ->capture_default_str();
  auto* file = app.add_option("--states", options.states, "JSON file with qpos, qvel and tau");
  app.add_option("--random", options.random, "number of random states")
      ->check(CLI::PositiveNumber)
      ->excludes(file);
  app.add_option("--seed", options.seed, "of the random states")->capture_default_str();
  app.add_option("--want", options.question.want,
                 "any of mass, inverse, acceleration, diagonal (of M^-1), log_det (of M), "
                 "operational (J M^-1 J'), factors")
      ->delimiter(',')
      ->check(CLI::IsMember(
          {"mass", "inverse", "acceleration", "diagonal", "log_det", "operational", "factors"}))
      ->capture_default_str();
  options.question.add_to(app);
  app.add_option("--out", options.out, "output file");
  return run_program(app, argc, argv, [&] { return run(options); });
}
