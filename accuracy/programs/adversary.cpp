// adversary: the mechanisms and states on which variants are most wrong without saying so, or most
// wrong beside what they say (judge.hpp), found by a search (search.hpp) over chains and trees of 1 to 9 DoF (genome.hpp).
// Or one island of a campaign of such searches (island.hpp).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include "accuracy/adversary/island.hpp"
#include "accuracy/adversary/record.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/stress/selection.hpp"

namespace kalmarm::adversary {
namespace {

namespace fs = std::filesystem;

constexpr int most_evaluations = 100000000;

struct Options {
  std::vector<std::string> variants, precisions = {"float32", "float64"};
  std::vector<std::string> methods = {"search", "random"};
  std::vector<std::string> tasks = {"acceleration"}, goals = {"error"}, kernels = {"spatial"};
  bool rows = false;
  std::string out, csv, unit;
  std::vector<std::string> from;
  std::uint64_t seed = 1;
  int evaluations = 5000;
  double condition = usual_condition;
  bool resumes = false;
};

Effort effort_of(const Asked& asked) {
  const Effort searches;
  return asked.searches ? searches : Effort{searches.sum(), 0, 0};
}

// What is asked of one variant, and the rounds that are done.
struct Search {
  Asked asked;
  std::unique_ptr<Judge> judge;  // refuses what it cannot be asked
  OutputFile file;               // of the rounds
  std::vector<Round> rounds;

  Search(const Asked& what, const Options& options) : asked(what), judge(make_judge(what.of)) {
    if (options.out.empty()) return;
    const std::string base = (fs::path(options.out) / asked.slug()).string();
    const std::string path = base + ".rounds.json";
    file = OutputFile(path);
    for (const char* find : {".xml", ".json"})
      OutputFile(base + find);  // refused now, not at the end
    if (options.resumes) rounds = read_rounds(path, asked);
  }
};

// What the search maximises. The arguments must outlive it.
Objective objective_of(const Asked& asked, Judge& judge) {
  return [&](const Genome& genome) {
    return judge.look(decode(genome, asked.of.kernel)).value(asked.of.goal, asked.condition);
  };
}

// Rounds until the evaluations are spent.
void complete(Search& search, const Options& options, Progress& progress) {
  const Asked& asked = search.asked;
  std::vector<Round>& rounds = search.rounds;
  const Objective objective = objective_of(asked, *search.judge);
  while (evaluations_of(rounds) < options.evaluations) {
    progress.step(asked.slug());
    rounds.push_back(next_round(objective, effort_of(asked), asked.seed, rounds));
    search.file.write(to_json(asked, rounds));
  }
}

// In words: "Ladder<last_bits> float32 inverse claim search".
std::string words(const Asked& asked) {
  std::string out = asked.of.variant + ' ' + asked.of.precision + ' ' + to_string(asked.of.task) +
                    ' ' + to_string(asked.of.goal);
  if (asked.of.kernel != Kernel::spatial) out += std::string(" ") + to_string(asked.of.kernel);
  if (asked.of.rows) out += " rows";
  return out + ' ' + asked.method();
}

// The rows of one case; what was found is written beside them.
std::string run_case(Search& search, const Options& options, Progress& progress) {
  const Asked& asked = search.asked;
  const std::vector<Round>& rounds = search.rounds;
  Judge& judge = *search.judge;
  complete(search, options, progress);
  const Round& best = best_of(rounds);
  if (best.value <= told) {
    std::printf("%-64s no silent error in %d evaluations\n", words(asked).c_str(),
                evaluations_of(rounds));
    return csv_rows(asked, rounds, {}, {}, "");
  }
  const Mechanism mechanism = decode(best.best, asked.of.kernel);
  const Verdict verdict = judge.look(mechanism);
  if (verdict.value(asked.of.goal, asked.condition) != best.value)
    throw InputError(asked.slug() + ": resumed from rounds of another program: begin without them");
  if (!options.out.empty()) write_find((fs::path(options.out) / asked.slug()).string(), mechanism);
  char kS[40] = "";
  if (!std::isnan(verdict.kS)) std::snprintf(kS, sizeof kS, ", kS %.2g", verdict.kS);
  std::printf("%-64s %.2g wrong, %.2g of what is claimed%s, nv %d, after %d evaluations\n",
              words(asked).c_str(), verdict.error, verdict.excess, kS, mechanism.model.nv(),
              evaluations_of(rounds));
  return csv_rows(asked, rounds, verdict, mechanism.model, options.out.empty() ? "" : asked.slug());
}

// The one of `all` that has this name; the command line has checked that there is one.
template <class T>
T named(const std::string& name, const std::vector<T>& all) {
  return *std::ranges::find_if(all, [&](T one) { return to_string(one) == name; });
}

const std::vector<Goal> goals = {Goal::error, Goal::claim};
const std::vector<Kernel> kernels = {Kernel::spatial, Kernel::spatial_at_rest,
                                     Kernel::translational};

template <class T>
std::vector<std::string> names(const std::vector<T>& all) {
  std::vector<std::string> out;
  for (const T one : all) out.emplace_back(to_string(one));
  return out;
}

std::vector<Asked> all_asked(const Options& options) {
  std::vector<Asked> out;
  for (const std::string& variant : options.variants)
    for (const std::string& precision : options.precisions)
      for (const std::string& task : options.tasks)
        for (const std::string& goal : options.goals)
          for (const std::string& kernel : options.kernels)
            for (const std::string& method : options.methods)
              out.push_back({{variant, precision, named(task, tasks()), named(goal, goals),
                              named(kernel, kernels), options.rows},
                             options.seed,
                             method == "search",
                             options.condition});
  return out;
}

int rounds_for(int evaluations) { return (evaluations + Effort().sum() - 1) / Effort().sum(); }

// SEED+EVALUATIONS
Island island_of(const Options& options) {
  const std::vector<Asked> all = all_asked(options);
  if (all.size() != 1)
    throw InputError(
        "--unit is one search: one variant, precision, task, objective, kernel, method");
  Island out{all.front()};
  char plus = 0, rest = 0;
  std::istringstream text(options.unit);
  const bool digits = options.unit.find_first_not_of("0123456789+") == std::string::npos;
  if (!digits || !(text >> out.asked.seed >> plus >> out.evaluations) || plus != '+' ||
      text >> rest || out.evaluations < 1 || out.evaluations > most_evaluations)
    throw InputError("unit '" + options.unit + "' is not SEED+EVALUATIONS, up to " +
                     std::to_string(most_evaluations));
  return out;
}

int run_unit(const Options& options) {
  if (options.out.empty()) throw InputError("--out is required");
  const Island island = island_of(options);
  const std::unique_ptr<Judge> judge = make_judge(island.asked.of);
  for (const std::string& file : options.from) add_input(file);
  OutputFile out(options.out);
  const Provenance made = provenance();
  const Objective objective = objective_of(island.asked, *judge);
  std::vector<Round> rounds = immigrants(options.from, island, made, objective);
  Progress progress(rounds_for(island.evaluations));
  while (evaluations_of(rounds) < island.evaluations) {
    progress.step(island.asked.slug());
    rounds.push_back(next_round(objective, effort_of(island.asked), island.asked.seed, rounds));
  }
  out.write(island_record(island, made, rounds, *judge));
  return 0;
}

int run(Options options) {
  options.variants = stress::select(options.variants, stress::variant_names(), "variant");
  if (!options.unit.empty()) return run_unit(options);
  if (options.out.empty() && options.csv.empty()) throw InputError("--out or --csv is required");
  if (options.resumes && options.out.empty()) throw InputError("--resume needs --out");
  if (!options.out.empty()) {
    std::error_code error;
    fs::create_directories(options.out, error);
    if (error) throw InputError(options.out + ": " + error.message());
  }
  OutputFile csv(options.csv);
  std::vector<Search> searches;
  for (const Asked& asked : all_asked(options)) searches.emplace_back(asked, options);
  std::string text = csv_header;
  Progress progress(static_cast<int>(searches.size()) * rounds_for(options.evaluations));
  for (Search& search : searches) text += run_case(search, options, progress);
  csv.write(text);
  return 0;
}

}  // namespace
}  // namespace kalmarm::adversary

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app(
      "The mechanism and state on which a variant's answer is most wrong without a warning, or "
      "most "
      "wrong beside the error that it claims, by search over chains and trees of 1 to 9 DoF, "
      "beside "
      "what as many random ones show.",
      "adversary");
  adversary::Options options;
  app.add_option("--variant", options.variants,
                 "variants; a name that ends in * takes all that begin so; stress --list prints "
                 "them")
      ->required();
  app.add_option("--precision", options.precisions, "float32, float64 or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  app.add_option("--task", options.tasks, "what is asked")
      ->delimiter(',')
      ->check(CLI::IsMember(adversary::names(adversary::tasks())))
      ->capture_default_str();
  app.add_option("--objective", options.goals,
                 "what is maximised: the error, or the error over what is claimed: Outcome::error "
                 "of an answer that has it, else 1e-2 in float32 and 1e-6 in float64")
      ->delimiter(',')
      ->check(CLI::IsMember(adversary::names(adversary::goals)))
      ->capture_default_str();
  app.add_option("--kernel", options.kernels,
                 "mechanisms that this kernel answers where a variant has it, by it")
      ->delimiter(',')
      ->check(CLI::IsMember(adversary::names(adversary::kernels)))
      ->capture_default_str();
  app.add_flag("--rows", options.rows, "the state is one of 32 rows, which are answered together");
  app.add_option("--method", options.methods, "search, random (drawn alone) or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"search", "random"}))
      ->capture_default_str();
  auto* evaluations =
      app.add_option("--evaluations", options.evaluations,
                     "mechanisms that are judged by each method, rounded up to whole rounds");
  evaluations->check(between(1, adversary::most_evaluations))->capture_default_str();
  auto* seed = app.add_option("--seed", options.seed, "the same seed, the same result");
  seed->check(any_seed())->capture_default_str();
  app.add_option("--condition", options.condition,
                 "structured condition number above which an error counts for less: rounding each "
                 "parameter changes such an answer by as many roundoffs")
      ->check(positive())
      ->capture_default_str();
  app.add_option("--out", options.out,
                 "folder for what is found, as NAME.xml and NAME.json, which evaluate reads, and "
                 "for the rounds that are done");
  auto* resume =
      app.add_flag("--resume", options.resumes, "go on after the rounds that --out holds");
  auto* csv = app.add_option("--csv", options.csv, "file for the best so far against evaluations");
  auto* unit = app.add_option("--unit", options.unit,
                              "SEED+EVALUATIONS: an island of a campaign, one search by one "
                              "method, whose best genomes --out, a JSON file, is for");
  for (auto* other : {evaluations, seed, resume, csv}) unit->excludes(other);
  app.add_option("--from", options.from,
                 "files of islands: a unit starts from the best that they have found")
      ->needs(unit);
  return run_program(app, argc, argv, [&] { return adversary::run(options); });
}
