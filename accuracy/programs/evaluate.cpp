// evaluate: one variant on given or random states -> JSON.
//
// What the question does not need is left out (dynamics/plan.hpp), unless --no-pruning says so.
// "asked" names the DoF of the results where these are not all, "sites" those of J M^-1 J'.
//
// A variant that answers but warns (kalmarm/outcome.hpp) says so in the state: "warning", with the
// joint and its numbers, "error_estimate" and "refinement_steps" where it has them, "widened" where
// it was refined by factors of a wider precision. `--variant auto` chooses (advice.hpp) for these
// states; "advice" says by what.
//
// With --step everything is of M^ and the step's acceleration (accuracy/contenders/asked_step.hpp), and
// "next" has the state after it.
//
// The truth of what a variant is asked in float32 is that of parameters and a state as float32 holds
// them: `--precision mp --rounded float32`.
#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "accuracy/contenders/advice.hpp"
#include "accuracy/contenders/asked_step.hpp"
#include "accuracy/contenders/coupled.hpp"
#include "accuracy/contenders/evaluation.hpp"
#include "accuracy/measures/real.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/dynamics/plan.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/scene/memory_limit.hpp"
#include "robots/scene/state_file.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

struct Options {
  std::string scene, states, out;
  LoadOptions read;
  Contender by;
  QuestionOptions question;
  std::string rounded = "float64";
  int random = 0, digits = 50;
  double tolerance = 1e-6;
  std::uint64_t seed = 1;
  bool list = false;
  std::optional<Integrator> step;
  double h = 0.002;
  std::optional<double> damping, stiffness;
};

constexpr const char* automatic = "auto";

std::string place(const Scene& scene, std::size_t state) {
  return scene.name + ": state " + std::to_string(state) + ": ";
}

// As float32 holds them.
State rounded(const State& state) {
  const auto held = [](const VectorX<double>& x) -> VectorX<double> {
    return x.cast<float>().cast<double>();
  };
  return {held(state.q), held(state.qd), held(state.tau)};
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

// What --variant auto uses.
struct Choice {
  Contender by;
  json advice;
};

Choice choose(const Options& options, const Scene& scene, const Question& question,
              const std::vector<State>& states) {
  if (std::ranges::find(options.question.want, "factors") != options.question.want.end())
    throw InputError("--variant auto gives no factors");
  if (options.by.precision == "mp") throw InputError("--variant auto is for float32 and float64");
  const auto advisor =
      make_advisor(scene, options.question, question, states, options.by.precision);
  const Advice advice = advise(*advisor, options.tolerance);
  const Candidate& chosen = advisor->candidates()[advice.candidate];
  const Observation& seen = advisor->observe(advice.candidate);
  std::fprintf(stderr, "evaluate: auto: %s\n", advice.reason.c_str());
  return {{chosen.variant, to_string(chosen.precision)},
          {{"tolerance", options.tolerance},
           {"worst_error", seen.worst},
           {"predicted_error", seen.predicted},
           {"enough", advice.enough},
           {"reason", advice.reason}}};
}

Evaluator evaluator(const Options& options, const Contender& used, const Scene& scene,
                    const Question& question, const std::optional<Couplings>& couplings,
                    const AskedStep* step) {
  try {
    return couplings ? coupled(make_evaluator(used, uncoupled(options.question), scene, question),
                               *couplings, options.question)
                     : make_evaluator(used, options.question, scene, question, step);
  } catch (const std::invalid_argument& e) {  // a parameter that float32 does not hold
    throw InputError(scene.name + (options.rounded == "float32" ? ": rounded to float32: " : ": ") +
                     e.what());
  }
}

json evaluate(const Options& options, const Contender& used, const Scene& scene,
              const Question& question, const std::optional<Couplings>& couplings,
              const AskedStep* step, const std::vector<State>& states) {
  constexpr double number_bytes = 64;  // of JSON, and its text
  const std::vector<std::string>& want = options.question.want;
  const auto matrices = std::count(want.begin(), want.end(), "mass") +
                        std::count(want.begin(), want.end(), "inverse");
  const double nv = scene.model.nv();
  refuse_large(scene.name + ": matrices of " + std::to_string(states.size()) + " states",
               static_cast<double>(states.size()) * double(matrices) * nv * nv * number_bytes);
  const Evaluator answer = evaluator(options, used, scene, question, couplings, step);
  Note warnings;
  json out = json::array();
  {
    Progress progress(static_cast<int>(states.size()));
    for (const State& state : states) {
      const std::string where = place(scene, out.size());
      progress.step("state " + std::to_string(out.size()));
      Result a = answer(state);
      if (!a.outcome)
        throw InputError(where + describe(a.outcome, scene) + " (" + used.variant + ", " +
                         used.precision + ")");
      if (a.outcome.warns()) warnings.add(where + describe(a.outcome, scene));
      add_outcome(a.outcome, scene, a.entry);
      out.push_back(std::move(a.entry));
    }
  }
  warnings.tell("warning", states.size());
  return out;
}

std::optional<AskedStep> asked_step(const Options& options, const Scene& scene) {
  if (!options.step) return std::nullopt;
  if (options.question.selects() || options.question.at_rest)
    throw InputError(
        "--step is of the whole robot that moves: no --dofs, --locked, --free or --at-rest");
  AskedStep out(scene, *options.step, options.h,
                with_terms(joint_terms_of(scene), scene.model, options.damping, options.stiffness));
  if (options.read.imposes_couplings && !out.rows().imposes())
    throw InputError(scene.name + ": has no couplings of joints");
  return out;
}

int run(const Options& options) {
  if (options.list) {
    for (const auto& variant : all_variants<double>()) std::printf("%s\n", variant.name.c_str());
    std::printf("%s\n", mujoco_variant);
    return 0;
  }
  if (options.scene.empty()) throw InputError("SCENE is required");
  if (options.by.variant.empty()) throw InputError("--variant is required; --list prints them");
  if (options.out.empty()) throw InputError("--out is required");

  const bool rounds = options.rounded == "float32";
  if (rounds && options.by.precision != "mp") throw InputError("--rounded is for --precision mp");
  OutputFile file(options.out);
  LoadOptions read = options.read;
  read.takes_steps = options.step.has_value();
  Scene scene = open_scene(options.scene, read);
  std::optional<AskedStep> step = asked_step(options, scene);
  if (step) scene.model = step->model(std::move(scene.model));
  if (step && rounds) step = step->rounded();
  if (rounds) scene.model = scene.model.cast<float>().cast<double>();
  const bool couples = options.read.imposes_couplings && !step;  // of a step they are rows
  const Question question =
      question_of(scene, couples ? uncoupled(options.question) : options.question);
  const std::optional<Couplings> couplings =
      couples ? std::optional<Couplings>(scene) : std::nullopt;
  std::vector<State> states;
  if (!options.states.empty()) {
    StateFile file = read_states(scene, options.states);
    if (file.normalized > 0)
      add_note(std::to_string(file.normalized) + " quaternion(s) normalised in " + options.states);
    for (const State& state : file.states)
      states.push_back(checked_state(scene, question, state, place(scene, states.size())));
  } else if (!options.read.key.empty() && options.random == 0) {
    states = {asked_state(scene, question, home_state(scene))};
  } else {
    states = random_states(scene, options.random > 0 ? options.random : 1, options.seed);
    for (State& state : states) state = asked_state(scene, question, state);
  }
  if (couplings)
    for (std::size_t i = 0; i < states.size(); ++i)
      states[i] = options.states.empty() ? couplings->imposed(states[i])
                                         : couplings->checked(states[i], place(scene, i));

  if (rounds)
    for (State& state : states) state = rounded(state);

  std::optional<Choice> choice;
  if (options.by.variant == automatic && step)
    throw InputError("--variant auto chooses for forward dynamics; with --step name a variant");
  if (options.by.variant == automatic && couplings)
    throw InputError("--variant auto chooses for a robot without couplings; name a variant");
  if (options.by.variant == automatic) choice = choose(options, scene, question, states);
  Contender used = choice ? choice->by : options.by;
  if (used.precision.empty()) used.precision = "float64";
  const Digits digits(options.digits);
  json document = {{"robot", scene.name},
                   {"nv", scene.model.nv()},
                   {"dofs", scene.model.names()},
                   {"variant", used.variant},
                   {"precision", used.precision}};
  if (rounds) document["rounded"] = options.rounded;
  if (step) document["step"] = {{"integrator", to_string(step->integrator())}, {"h", options.h}};
  if (choice) document["advice"] = choice->advice;
  const DynamicsOptions asked = asked_of(used, options.question, question);
  const Plan plan = make_plan(scene.model, question, asked.rules);
  if (static_cast<int>(plan.asked.size()) < scene.model.nv()) {
    for (const int k : plan.asked) document["asked"].push_back(scene.model.name(k));
  }
  if (couplings)
    for (const int k : couplings->left()) document["asked"].push_back(scene.model.name(k));
  if (!question.frames.empty()) document["sites"] = options.question.sites;
  document["states"] =
      evaluate(options, used, scene, question, couplings, step ? &*step : nullptr, states);
  file.write(document.dump() + "\n");
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
  add_scene(app, options.scene, options.read);
  app.add_flag("--list", options.list, "print the variants, one a line");
  app.add_option("--variant", options.by.variant,
                 "e.g. 'Sequential<ArrayMGS>'; auto chooses for this robot and these states");
  app.add_option("--tolerance", options.tolerance, "error that auto may leave, relative")
      ->check(positive())
      ->capture_default_str();
  app.add_option("--precision", options.by.precision,
                 "float32, float64 (default) or mp (multi-precision)")
      ->check(CLI::IsMember({"float32", "float64", "mp"}));
  app.add_option("--digits", options.digits, "decimal digits of mp")
      ->check(between(20, 10000))
      ->capture_default_str();
  app.add_option(
         "--rounded", options.rounded,
         "float32: mp's answer for the robot's parameters and states as float32 holds them, "
         "which is the truth of variants in float32")
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  auto* file = app.add_option("--states", options.states, "JSON file with qpos, qvel and tau");
  app.add_option("--random", options.random, "number of random states")
      ->check(number_of_states())
      ->excludes(file);
  app.add_option("--seed", options.seed, "of the random states")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--want", options.question.want,
                 "any of mass, inverse, acceleration, diagonal (of M^-1), log_det (of M), "
                 "operational (J M^-1 J'), factors")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(
          {"mass", "inverse", "acceleration", "diagonal", "log_det", "operational", "factors"}))
      ->capture_default_str();
  options.question.add_to(app);
  app.add_flag(
      "--impose-couplings", options.read.imposes_couplings,
      "the file's linear couplings of joints (a URDF's mimic) hold exactly: mass, inverse, "
      "acceleration of the joints that are left; with --step, at its end: inverse and acceleration "
      "of all");
  const std::map<std::string, Integrator> integrators = {{"euler", Integrator::euler},
                                                         {"implicitfast", Integrator::implicitfast},
                                                         {"discrete", Integrator::discrete}};
  auto* step = app.add_option_function<std::string>(
      "--step", [&](const std::string& name) { options.step = integrators.at(name); },
      "an implicit step with the file's springs, dampers, fixed tendons and actuators, by MuJoCo's "
      "integrator of this name: its acceleration, the next state, and mass, inverse, ... of M + h "
      "B (+ h^2 K)");
  step->check(CLI::IsMember({"euler", "implicitfast", "discrete"}));
  app.add_option("--h", options.h, "of the step [s]")
      ->check(positive())
      ->needs(step)
      ->capture_default_str();
  app.add_option("--damping", options.damping,
                 "of every hinge and slide [N m s/rad or N s/m]; default: the file's joints")
      ->check(not_negative())
      ->needs(step);
  app.add_option("--stiffness", options.stiffness,
                 "likewise, about q = 0 or the file's reference [N m/rad or N/m]")
      ->check(not_negative())
      ->needs(step);
  app.add_option("--out", options.out, "output file");
  return run_program(app, argc, argv, [&] { return run(options); });
}
