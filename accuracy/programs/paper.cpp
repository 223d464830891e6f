// paper: every numbered equation of the paper as a check, as it is printed and as it is corrected.
//
// Precisions: float64, and multi-precision (mp), which tells a wrong formula from rounding. mp
// carries `digits` decimal digits, more only if M is so ill-conditioned that inverting it would
// take more than five of them: then log10(condition) - 3 on top. A corrected form holds if its
// residual is at most
//   float64  1000 n u kappa,  kappa a bound of the condition of M scaled to unit diagonal
//   mp       10^(5 - digits)
// and a printed form is called a misprint where its residual is more than that.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "accuracy/paper/equations.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/study/inverse_mass/condition.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm {
namespace {

using json = nlohmann::ordered_json;

constexpr double heaviest = 4;  // link of the random chain; the lightest is 1

struct Options {
  std::string robot;
  LoadOptions read;
  int links = 6;
  std::uint64_t seed = 1;
  std::string precision = "both";
  unsigned digits = 50;
  std::string json_file;
};

// A mechanism in a state.
struct Case {
  Scene scene;
  State state;

  Case(const Scene& what, std::uint64_t seed)
      : scene(what), state(random_states(scene, 1, seed).front()) {}
};

// Refuses what cannot be checked, with the joint and the numbers.
template <class T>
void require_sound(const Case& c) {
  const std::string where = "scene '" + c.scene.name + "': ";
  char text[120];
  if (const int n = c.scene.model.nv(); n > largest_dense)
    throw InputError(where + std::to_string(n) +
                     " degrees of freedom; the literal operators are dense and go up to " +
                     std::to_string(largest_dense));
  const Soundness sound = soundness<T>(c.scene.model, c.state);
  if (sound.flaw) {
    std::snprintf(text, sizeof text, ": %.3g against a scale of %.3g", sound.flaw.value,
                  sound.flaw.scale);
    throw InputError(where + "link of joint '" + c.scene.model.name(sound.flaw.link) +
                     "': " + to_string(sound.flaw.kind) + text);
  }
  if (!sound.outcome) {
    std::snprintf(text, sizeof text, ": D = %.3g against a scale of %.3g", sound.outcome.D,
                  sound.outcome.scale);
    throw InputError(where + "mass matrix " + to_string(sound.outcome.status) + " at joint '" +
                     c.scene.model.name(sound.outcome.joint) + "'" + text);
  }
}

double condition_bound(const Case& c) {
  const int nv = c.scene.model.nv();
  MatrixX<double> X(nv, nv);
  const auto solver = make_solver<double>("Sequential<ArrayMGS>", c.scene.model);
  if (const Outcome outcome = solver->inverse(c.state.q, X); !outcome)
    throw InputError("scene '" + c.scene.name + "': mass matrix " + to_string(outcome.status));
  return scaled_condition_bound(X.inverse(), X);
}

struct Run {
  std::string precision;
  unsigned digits;
  double condition, tolerance;
  std::vector<Row> rows;

  std::string verdict(const Row& row) const {
    if (!(row.residual <= tolerance)) return "fails";
    return row.printed <= tolerance ? "holds" : "misprint";
  }
};

json number_or_null(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json record(const Options& options, const Case& main, const Case& other,
            const std::vector<Run>& runs, bool pass) {
  json out = {{"scene", main.scene.name},    {"beyond_scene", other.scene.name},
              {"seed", options.seed},        {"pass", pass},
              {"precisions", json::array()}, {"rows", json::array()}};
  for (const Run& run : runs)
    out["precisions"].push_back(
        {{"precision", run.precision}, {"digits", run.digits}, {"condition", run.condition}});
  for (std::size_t i = 0; i < runs.front().rows.size(); ++i) {
    const Row& row = runs.front().rows[i];
    json entry = {{"id", row.equation.id},
                  {"section", row.section},
                  {"result", row.equation.result},
                  {"statement", row.equation.statement},
                  {"corrected", row.equation.corrected},
                  {"note", row.equation.note}};
    for (const Run& run : runs)
      entry["residuals"][run.precision] = {{"printed", number_or_null(run.rows[i].printed)},
                                           {"corrected", number_or_null(run.rows[i].residual)},
                                           {"tolerance", run.tolerance},
                                           {"verdict", run.verdict(run.rows[i])}};
    out["rows"].push_back(std::move(entry));
  }
  return out;
}

std::string residual_text(double value) {
  if (std::isinf(value)) return "–";
  char text[32];
  std::snprintf(text, sizeof text, "%.1e", value);
  return text;
}

void print(const Case& main, const Case& other, const std::vector<Run>& runs) {
  std::printf("The paper on %s, beyond it on %s\n", main.scene.name.c_str(),
              other.scene.name.c_str());
  for (const Run& run : runs)
    std::printf("%s: %u digits, condition of M %.1e, tolerance %.1e\n", run.precision.c_str(),
                run.digits, run.condition, run.tolerance);
  std::printf("\n%-12s", "equation");
  for (const Run& run : runs)
    std::printf(" %9s %9s %-9s", run.precision.c_str(), "corrected", "verdict");
  std::printf("  states\n");
  for (std::size_t i = 0; i < runs.front().rows.size(); ++i) {
    const Equation& equation = runs.front().rows[i].equation;
    // ids are not ASCII alone: pad by what is seen
    int seen = 0;
    for (const char c : equation.id) seen += (c & 0xC0) != 0x80;
    std::printf("%s%*s", equation.id.c_str(), std::max(0, 12 - seen), "");
    for (const Run& run : runs) {
      const Row& row = run.rows[i];
      std::printf(" %9s %9s %-9s",
                  std::isinf(row.printed) ? "none" : residual_text(row.printed).c_str(),
                  residual_text(row.residual).c_str(), run.verdict(row).c_str());
    }
    std::printf("  %s\n", equation.statement.c_str());
    if (!equation.corrected.empty())
      std::printf("%*s  true: %s\n", 12 + 30 * static_cast<int>(runs.size()), "",
                  equation.corrected.c_str());
  }
}

template <class T>
Run check(const char* precision, unsigned digits, double tolerance, const Case& main,
          const Case& other, double condition) {
  require_sound<T>(main);
  require_sound<T>(other);
  return {precision, digits, condition, tolerance,
          check_paper<T>(main.scene.model, main.state, other.scene.model, other.state)};
}

int run(const Options& options) {
  const bool chosen = !options.robot.empty();
  const std::string size = std::to_string(options.links);
  const Case main(chosen ? open_scene(options.robot, options.read)
                         : generated_scene("chain:" + size,
                                           random_chain(options.links, options.seed, heaviest)),
                  options.seed);
  const int tree_links = std::min(2 * options.links + 2, largest_dense);
  const Case other = chosen ? main
                            : Case(generated_scene("tree:" + std::to_string(tree_links),
                                                   random_tree(tree_links, options.seed, heaviest)),
                                   options.seed);
  OutputFile file = json_output(options.json_file);
  require_sound<double>(main);
  require_sound<double>(other);
  const double condition = std::max(condition_bound(main), condition_bound(other));
  const int n = std::max(main.scene.model.nv(), other.scene.model.nv());

  std::vector<Run> runs;
  Progress progress(2);
  if (options.precision != "mp") {
    progress.step("float64");
    const Digits digits(60);  // of the truth
    runs.push_back(check<double>("float64", 16, 1000.0 * n * unit_roundoff<double>() * condition,
                                 main, other, condition));
  }
  if (options.precision != "float64") {
    progress.step("mp");
    const int lost = static_cast<int>(std::ceil(std::log10(condition)));
    const unsigned carried = options.digits + static_cast<unsigned>(lost > 5 ? lost - 3 : 0);
    const Digits digits(carried);
    runs.push_back(
        check<Real>("mp", carried, std::pow(10.0, 5.0 - options.digits), main, other, condition));
  }

  bool pass = true;
  std::string failed;
  for (const Run& run : runs)
    for (const Row& row : run.rows)
      if (run.verdict(row) == "fails") {
        pass = false;
        failed += (failed.empty() ? "" : ", ") + row.equation.id + " in " + run.precision;
      }
  file.write(record(options, main, other, runs, pass).dump(1) + "\n");
  if (options.json_file != "-") print(main, other, runs);
  if (!pass) std::fprintf(stderr, "paper: error: does not hold as corrected: %s\n", failed.c_str());
  return pass ? 0 : 1;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app(
      "Every numbered equation of the paper as a check: its residual as printed and as corrected, "
      "in float64 and multi-precision. Exit 1 if a corrected form fails.",
      "paper");
  Options options;
  auto* robot =
      app.add_option("--robot", options.robot, std::string("SCENE to check: ") + scene_help);
  add_file_options(app, options.read);
  app.add_option("--links", options.links, "random chain of so many links")
      ->check(between(1, largest_dense))
      ->excludes(robot)
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the chain and of the state")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--precision", options.precision, "float64, mp or both")
      ->check(CLI::IsMember({"float64", "mp", "both"}))
      ->capture_default_str();
  app.add_option("--digits", options.digits, "decimal digits of mp")
      ->check(between(30, 1000))
      ->capture_default_str();
  app.add_option("--json", options.json_file, std::string("the rows: ") + json_help);
  return run_program(app, argc, argv, [&] { return run(options); });
}
