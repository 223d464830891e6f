// recommend: at which tolerance Dynamics is enough for a robot, task by task and error by error asked
// for (algorithms/advisor/advisor.hpp), with the error and time of every contender. Of rows of
// states, tasks that end in _batch, float32 may be enough.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "accuracy/contenders/advice.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/model/short_text.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

struct Options {
  std::string scene, json_file;
  LoadOptions read;
  std::vector<std::string> want = {"acceleration", "inverse"};
  std::vector<double> tolerances = {1e-3, 1e-5, 1e-6, 1e-9, 1e-12};
  QuestionOptions question;
  int random = 200;
  std::uint64_t seed = 1;
};

json described(Advisor& advisor, int candidate) {
  const Candidate& one = advisor.candidates()[candidate];
  const Observation& seen = advisor.observe(candidate);
  return {{"variant", one.variant},
          {"precision", to_string(one.precision)},
          {"nanoseconds", advisor.nanoseconds(candidate)},
          {"median", seen.median},
          {"worst", seen.worst},
          {"predicted", seen.predicted},
          {"failures", seen.failures},
          {"warnings", seen.warnings}};
}

json advice_on(const Options& options, const Scene& scene, const std::string& task, Calls calls) {
  QuestionOptions asked = options.question;
  asked.want = {task};
  const Question question = question_of(scene, asked);
  std::vector<State> states = random_states(scene, options.random, options.seed);
  for (State& state : states) state = asked_state(scene, question, std::move(state));
  const auto advisor = make_advisor(scene, asked, question, states, "", calls);
  json out = {{"contenders", json::array()}, {"choices", json::array()}};
  for (const double tolerance : options.tolerances) {
    const Advice advice = advise(*advisor, tolerance);
    json choice = described(*advisor, advice.candidate);
    choice["tolerance"] = tolerance;
    choice["enough"] = advice.enough;
    choice["reason"] = advice.reason;
    out["choices"].push_back(std::move(choice));
  }
  if (!options.json_file.empty())
    for (int i = 0; i < static_cast<int>(advisor->candidates().size()); ++i)
      out["contenders"].push_back(described(*advisor, i));
  return out;
}

const std::string of_rows = "_batch";  // ends a task

std::string errs(double worst) {
  return worst > 0 ? "errs by " + short_text("%.1e", worst) + " at most" : "errs in no state tried";
}

// As it is written: "Dynamics<double>", "Dynamics<double> {.tolerance = last_bits}".
std::string door(const json& choice) {
  const std::string scalar = choice["precision"] == "float32" ? "float" : "double";
  const bool by_default = choice["variant"] == ladder_variants<double>().front().name;
  return "Dynamics<" + scalar + '>' + (by_default ? "" : " {.tolerance = last_bits}");
}

// "for acceleration to 1e-6 take Dynamics<double>", of the error in the middle; of rows after a task.
std::string sentence_of(const json& tasks) {
  std::string out;
  for (const auto& [task, advice] : tasks.items()) {
    const json& choices = advice["choices"];
    const json& choice = choices[choices.size() / 2];
    const bool rows = task.ends_with(of_rows);
    const std::string what =
        rows ? "rows of " + task.substr(0, task.size() - of_rows.size()) : task;
    if (!out.empty()) out += "; ";
    if (choice["enough"])
      out += "for " + what + " to " + short_text("%.3g", choice["tolerance"]) + " take " +
             door(choice) + " (" + time_text(choice["nanoseconds"]) + " a state, " +
             errs(choice["worst"]) + ')';
    else
      out += "for " + what + " nothing reaches " + short_text("%.3g", choice["tolerance"]) + ": " +
             door(choice) + " comes nearest";
  }
  return out;
}

void print(const json& tasks, const std::string& sentence) {
  std::printf("%s\n", sentence.c_str());
  for (const auto& [task, advice] : tasks.items()) {
    std::printf("\n%-18s %-10s %-42s %9s %9s\n", task.c_str(), "error", "take", "predicted", "us");
    for (const json& choice : advice["choices"])
      std::printf("%-18s %-10.3g %-42s %9.1e %9.3g%s\n", "", choice["tolerance"].get<double>(),
                  door(choice).c_str(), choice["predicted"].get<double>(),
                  choice["nanoseconds"].get<double>() / 1e3,
                  choice["enough"].get<bool>() ? "" : "  not enough");
  }
}

int run(const Options& options) {
  const Scene scene = open_scene(options.scene, options.read);
  OutputFile file = json_output(options.json_file);
  json tasks;
  {
    Progress progress(2 * static_cast<int>(options.want.size()));
    for (const std::string& task : options.want) {
      progress.step(task);
      tasks[task] = advice_on(options, scene, task, Calls::of_one_state);
      progress.step(task + of_rows);
      tasks[task + of_rows] = advice_on(options, scene, task, Calls::of_rows);
    }
  }
  const std::string sentence = sentence_of(tasks);
  if (options.json_file != "-") print(tasks, sentence);
  const json out = {{"robot", scene.name},
                    {"file", std::filesystem::path(scene.file).filename().string()},
                    {"load_options", initializer_of(options.read)},
                    {"nv", scene.model.nv()},
                    {"states", options.random},
                    {"seed", options.seed},
                    {"sentence", sentence},
                    {"tasks", tasks}};
  file.write(out.dump() + "\n");
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("Which tolerance is enough for a robot, for rows in which precision, and why.",
               "recommend");
  Options options;
  add_scene(app, options.scene, options.read)->required();
  app.add_option("--want", options.want, "any of acceleration, inverse, diagonal, log_det, mass")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"acceleration", "inverse", "diagonal", "log_det", "mass"}))
      ->capture_default_str();
  app.add_option("--tolerance", options.tolerances, "relative errors asked for")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(positive())
      ->capture_default_str();
  options.question.add_to(app);
  app.add_option("--random", options.random, "random states that it is for")
      ->check(number_of_states())
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of these states")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--json", options.json_file, std::string("all contenders too: ") + json_help);
  return run_program(app, argc, argv, [&] { return run(options); });
}
