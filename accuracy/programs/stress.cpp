// stress: stiff and extreme mechanisms x variants x precision -> one CSV (measure_case.hpp), or what
// the advisor chooses for them (measure_advice.hpp), or counts of a unit of a campaign
// (measure_unit.hpp), which this process alone works at and which is written whole or not at all.
//
// The work is split over processes (workers.hpp). Each takes the next case and appends its records to
// a journal, the folder OUT.journal; what stands there whole is not measured again when the program is started again with
// the same options. At the end the records are put in order and written to OUT at once.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/csv.hpp"
#include "accuracy/programs/common/held_signals.hpp"
#include "accuracy/programs/common/journal.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/provenance.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/programs/common/workers.hpp"
#include "accuracy/stress/measure_advice.hpp"
#include "accuracy/stress/measure_case.hpp"
#include "accuracy/stress/measure_unit.hpp"
#include "accuracy/stress/selection.hpp"
#include "accuracy/truth/truth.hpp"
#include "robots/scene/memory_limit.hpp"

namespace kalmarm::stress {
namespace {

namespace fs = std::filesystem;

constexpr int quick_wild = 150, full_wild = 10000;  // mechanisms of a wild family
constexpr double bytes_of_a_row = 200;              // of a CSV
constexpr double many_links = 1000;  // beyond, one seed is enough: its truth takes minutes

struct Options {
  std::vector<std::string> families, variants, precisions = {"float32", "float64"};
  std::vector<double> advice;      // tolerances; empty: every variant is measured
  std::vector<std::string> tasks;  // empty: those of the family
  std::string out, json_file, unit, rows;
  int seeds = 0, first_seed = 1, jobs = 0, worst = Campaign().worst;
  bool quick = false, full = false, list = false;
};

struct Job {
  const Family* family;
  double value;
  std::uint64_t seed;
  std::string precision;

  std::string name() const {
    return family->name + ' ' + number(value) + " seed " + std::to_string(seed) + ' ' + precision;
  }
};

// What is measured of a family unless variants are named. Other frames are of interest where
// distances are large or masses uneven; wild mechanisms are many, and are for what may be chosen.
Selection selection(const Family& family, const Options& options) {
  static const std::set<std::string> framed = {"straight", "random_chain", "heavy_tip",
                                               "far_com",  "base_offset",  "floating_base"};
  Selection out{options.variants, {}};
  const bool wild = family.kind == FamilyKind::wild;
  if (wild) out.tasks = {"white", "dynamics"};
  if (!options.tasks.empty()) out.tasks = options.tasks;
  if (!out.variants.empty()) return out;
  for (const auto& variant : registered_variants<double>()) {
    const VariantTraits& traits = variant.traits;
    if (traits.in_world_frame && !framed.contains(family.name)) continue;
    const bool chosen = traits.kind != VariantKind::closed_form &&
                        traits.kind != VariantKind::scan && !traits.mixed_precision;
    if (wild && !chosen) continue;
    out.variants.push_back(variant.name);
  }
  return out;
}

int seeds(const Family& family, double value, const Options& options) {
  if (options.seeds > 0) return options.seeds;
  if (family.kind == FamilyKind::wild) return options.full ? full_wild : quick_wild;
  if (!family.random || (family.parameter == "N" && value > many_links)) return 1;
  return options.full ? 5 : 3;
}

std::vector<Job> plan(const std::vector<Family>& all, const Options& options) {
  const std::vector<std::string> known = names_of(all);
  const std::vector<std::string> chosen =
      options.families.empty() ? known : select(options.families, known, "family");
  const std::vector<std::string> both = {"both"};
  const std::vector<std::string>& precisions = options.advice.empty() ? options.precisions : both;
  const auto each_value = [&](const auto& f) {
    for (const Family& family : all)
      if (std::ranges::find(chosen, family.name) != chosen.end())
        for (const double value : options.full ? family.full : family.quick)
          f(family, value, seeds(family, value, options));
  };
  double count = 0;
  each_value([&](const Family&, double, int seeds) { count += seeds * double(precisions.size()); });
  refuse_large(number(count) + " cases", 2 * sizeof(Job) * count);
  std::vector<Job> jobs;
  each_value([&](const Family& family, double value, int seeds) {
    for (int seed = options.first_seed; seed < options.first_seed + seeds; ++seed)
      for (const std::string& precision : precisions)
        jobs.push_back({&family, value, static_cast<std::uint64_t>(seed), precision});
  });
  return jobs;
}

std::string records(const Job& job, const Options& options) {
  const Family& family = *job.family;
  try {
    if (!options.advice.empty()) return measure_advice(family, job.value, job.seed, options.advice);
    return csv_rows(family, job.value, job.seed, job.precision,
                    measure_case(family.make(job.value, job.seed), job.seed, job.precision,
                                 selection(family, options)));
  } catch (const NoTruth& e) {
    std::fprintf(stderr, "stress: note: %s: %s\n", job.name().c_str(), e.what());
    return "";
  }
}

// Throws InputError where a worker could not go on. Ends with the program where a signal says so.
void run_workers(const std::vector<Job>& jobs, const std::vector<std::size_t>& todo,
                 const Options& options, const Journal& journal, OutputFile& out) {
  HeldSignals signals;
  const auto begin = [&] {
    out.unlock();
    const auto writer = std::make_shared<Journal::Writer>(journal.writer());
    return [&, writer](std::size_t i) { writer->append(todo[i], records(jobs[todo[i]], options)); };
  };
  work_in_processes({todo.size(), [&](std::size_t i) { return jobs[todo[i]].name(); }, begin},
                    options.jobs, signals);
  if (signals.waiting() != 0)
    std::fprintf(stderr, "stress: interrupted; what is measured is kept, run again to go on\n");
}  // and so to the signal

// OUT.journal; of an output that is no file, a folder that ends with the program.
class JournalFolder {
 public:
  JournalFolder(const std::string& out, bool is_file) : path_(out + ".journal"), stays_(is_file) {
    if (is_file) return;
    path_ = (fs::temp_directory_path() / "kalmarm-XXXXXX").string();
    if (!mkdtemp(path_.data())) throw InputError(path_ + ": no folder for a journal");
  }
  JournalFolder(const JournalFolder&) = delete;
  JournalFolder& operator=(const JournalFolder&) = delete;
  ~JournalFolder() {
    std::error_code error;
    if (!stays_) fs::remove_all(path_, error);
  }

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  bool stays_;
};

std::string key_of(const std::vector<Job>& jobs, const Options& options) {
  std::ostringstream key;
  key << fs::last_write_time("/proc/self/exe").time_since_epoch().count() << '\n';
  for (const std::string& variant : options.variants) key << variant << '\n';
  for (const std::string& task : options.tasks) key << "task " << task << '\n';
  for (const double tolerance : options.advice) key << "advice " << tolerance << '\n';
  for (const Job& job : jobs) key << job.name() << '\n';
  return key.str();
}

void print_list(const std::vector<Family>& all) {
  for (const Family& family : all)
    std::printf("%-28s %s: %s\n", family.name.c_str(), family.parameter.c_str(),
                family.describes.c_str());
  for (const std::string& name : variant_names()) std::printf("%s\n", name.c_str());
}

nlohmann::json listed(const std::vector<Family>& all) {
  nlohmann::json out = {{"families", nlohmann::json::array()},
                        {"variants", nlohmann::json::array()}};
  for (const Family& family : all)
    out["families"].push_back({{"name", family.name},
                               {"kind", to_string(family.kind)},
                               {"parameter", family.parameter},
                               {"describes", family.describes},
                               {"singular", !family.singular.empty()}});
  for (const auto& variant : all_variants<double>()) {
    const VariantTraits& traits = variant.traits;
    nlohmann::json tolerance;  // null but of the ladder where it is not the default
    if (traits.tolerance) tolerance = *traits.tolerance;
    out["variants"].push_back({{"name", variant.name},
                               {"equation", variant.equation},
                               {"kind", to_string(traits.kind)},
                               {"contender", traits.contender},
                               {"in_world_frame", traits.in_world_frame},
                               {"dense", traits.dense},
                               {"mixed_precision", traits.mixed_precision},
                               {"tolerance", tolerance},
                               {"citation", traits.citation}});
  }
  return out;
}

int list(const std::vector<Family>& all, const Options& options) {
  if (options.json_file != "-") print_list(all);
  json_output(options.json_file).write(listed(all).dump() + "\n");
  return 0;
}

std::vector<std::string> in_order(std::vector<std::string> names) {
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());  // as clang 14 wants it
  return names;
}

// The names are known, and so is what each of them is.
int run_unit(const std::vector<Family>& all, const Options& options) {
  const Unit unit = unit_of(options.unit, all);
  const Selection asked = selection(*unit.family, options);
  const Campaign campaign{in_order(asked.variants), in_order(options.precisions),
                          in_order(asked.tasks.empty() ? acceleration_tasks : asked.tasks),
                          options.worst};
  for (const std::string& task : campaign.tasks)
    if (std::ranges::find(acceleration_tasks, task) == acceleration_tasks.end())
      throw InputError("--unit counts accelerations, not task '" + task + "'");
  const double answers = double(unit.count) * double(campaign.precisions.size());
  const double rows = answers * double(campaign.variants.size() * campaign.tasks.size());
  if (!options.rows.empty()) refuse_large(number(rows) + " rows", bytes_of_a_row * rows);

  OutputFile out(options.out), csv(options.rows);
  std::string text = csv_header;
  Progress progress(static_cast<int>(std::min(answers, 1e9)));
  const Tally tally = measure_unit(
      unit, campaign, [&](const Measurement& measured, const std::string& precision, auto seed) {
        progress.step(unit.name());
        if (!options.rows.empty())
          text += csv_rows(*unit.family, unit.value, seed, precision, measured);
      });
  csv.write(text);
  out.write(unit_record(unit, campaign, provenance(), tally));
  return 0;
}

int run(Options options) {
  const std::vector<Family> all = all_families();
  if (options.list) return list(all, options);
  if (options.out.empty()) throw InputError("--out is required");
  options.variants = select(options.variants, variant_names(), "variant");
  if (!options.unit.empty()) return run_unit(all, options);
  const std::vector<Job> jobs = plan(all, options);

  OutputFile out(options.out);
  const JournalFolder folder(options.out, out.is_file());
  const Journal journal(folder.path(), key_of(jobs, options));
  const Journal::Found found = journal.read();
  if (found.garbled > 0)
    add_note(folder.path() +
             ": records that were changed or cut off and have been measured again: " +
             std::to_string(found.garbled));
  if (found.others > 0)
    add_note(folder.path() +
             ": files of other runs, which stay there: " + std::to_string(found.others));
  std::vector<std::size_t> todo;
  for (std::size_t i = 0; i < jobs.size(); ++i)
    if (!found.parts.contains(i)) todo.push_back(i);
  run_workers(jobs, todo, options, journal, out);
  std::string text = options.advice.empty() ? csv_header : advice_header;
  for (const auto& [index, block] : journal.read().parts) text += block;
  out.write(text);
  journal.remove();
  return 0;
}

}  // namespace
}  // namespace kalmarm::stress

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("Every variant on stiff and extreme mechanisms against truth, as CSV", "stress");
  stress::Options options;
  auto* family = app.add_option("--family", options.families,
                                "families; a name that ends in * takes all that begin so");
  app.add_option("--variant", options.variants, "variants, in the same way; default: all");
  app.add_option("--precision", options.precisions, "float32, float64 or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  std::vector<std::string> tasks = stress::acceleration_tasks;
  for (const char* of_matrices : {"inverse", "factors"}) tasks.emplace_back(of_matrices);
  app.add_option("--task", options.tasks, "tasks; default: all, of wild mechanisms white,dynamics")
      ->delimiter(',')
      ->check(CLI::IsMember(tasks));
  auto* advice =
      app.add_option("--advice", options.advice,
                     "tolerances: what the advisor chooses for every mechanism, and its error");
  advice->delimiter(',')->check(positive());
  auto* seeds = app.add_option("--seeds", options.seeds, "N seeds of every case");
  seeds->check(between(1, 10000000));
  auto* first_seed = app.add_option("--first-seed", options.first_seed, "the first of them");
  first_seed->check(between(1, 1000000000))->capture_default_str();
  auto* quick = app.add_flag("--quick", options.quick, "few values and seeds (default)");
  auto* full = app.add_flag("--full", options.full, "all values, 10 000 wild mechanisms");
  full->excludes(quick);
  auto* jobs = app.add_option("--jobs", options.jobs, "processes; default: one a core");
  jobs->check(between(1, 1024));
  auto* list = app.add_flag("--list", options.list, "print families and variants");
  auto* unit = app.add_option(
      "--unit", options.unit,
      "FAMILY/VALUE/FIRST+COUNT: COUNT seeds of a campaign, counted into one JSON file by this "
      "process");
  for (auto* other : {family, advice, seeds, first_seed, quick, full, jobs, list})
    unit->excludes(other);
  app.add_option("--worst", options.worst, "of a unit: worst cases kept, of each series")
      ->check(between(0, 100000))
      ->needs(unit)
      ->capture_default_str();
  app.add_option("--rows", options.rows, "of a unit: CSV file for every record too, without kappa")
      ->needs(unit);
  app.add_option("--json", options.json_file, std::string("the list: ") + json_help)->needs(list);
  app.add_option("--out", options.out, "file to write");
  return run_program(app, argc, argv, [&] { return stress::run(options); });
}
