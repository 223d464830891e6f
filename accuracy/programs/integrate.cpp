// integrate: calls of the right-hand side that an adaptive integrator needs for a free fall, by
// variant (integration.hpp) -> one CSV.
//   family,value,n,seed,precision,variant,calls,finished,energy_drift
// finished: 0 where the cap was reached or the variant refused a state; the drift is nan then.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/csv.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/stress/integration.hpp"
#include "accuracy/stress/parts.hpp"
#include "accuracy/stress/selection.hpp"
#include "robots/scene/memory_limit.hpp"

namespace kalmarm::stress {
namespace {

constexpr int default_seeds = 3;
constexpr double largest_chain = 100'000;  // the longest of --full

struct Options {
  std::vector<std::string> families = {"heavy_tip"};
  std::vector<std::string> variants = usual_variants;
  std::vector<std::string> precisions = {"float64"};
  std::vector<double> values;
  std::string out;
  Fall fall;
  int seeds = 0, first_seed = 1;
  bool quick = false, full = false;
};

// Those of the family, but mass ratios from 1 to 1e14, where the variants part.
std::vector<double> values_of(const Family& family, const Options& options) {
  if (!options.values.empty()) return options.values;
  if (family.parameter != "mass ratio") return options.full ? family.full : family.quick;
  return options.full ? decades(0, 14, 1) : std::vector<double>{1, 1e4, 1e8, 1e12, 1e14};
}

// A value is a size or a ratio, or a number of joints.
void require_meaning(const Family& family, const std::vector<double>& values) {
  const bool counts = family.parameter == "N";
  const double least = counts ? 1 : 0, most = counts ? largest_chain : 1e300;
  for (const double value : values)
    if (value < least || value > most)
      throw InputError(
          "family '" + family.name + "': " + family.parameter + " = " + number(value) +
          (value < least ? " is less than " + number(least) : " is more than " + number(most)));
}

// So that q' is the rate of q.
void require_hinges_and_slides(const Family& family, const Model<double>& model) {
  for (int k = 0; k < model.nv(); ++k) {
    const Coordinate coordinate = model.joint(k).coordinate;
    if (coordinate != Coordinate::angle && coordinate != Coordinate::distance)
      throw InputError("family '" + family.name + "': '" + model.name(k) +
                       "' is of a ball or a free joint; only hinges and slides are integrated");
  }
}

struct Job {
  const Family* family;
  double value;
  std::uint64_t seed;
};

std::vector<Job> plan(const std::vector<Family>& all, const Options& options) {
  const std::vector<std::string> chosen = select(options.families, names_of(all), "family");
  std::vector<Job> jobs;
  for (const Family& family : all) {
    if (std::ranges::find(chosen, family.name) == chosen.end()) continue;
    const std::vector<double> values = values_of(family, options);
    require_meaning(family, values);
    const int seeds = options.seeds > 0 ? options.seeds : family.random ? default_seeds : 1;
    refuse_large("cases of " + std::to_string(seeds) + " seeds",
                 2 * sizeof(Job) * (double(jobs.size()) + double(seeds) * double(values.size())));
    for (const double value : values)
      for (int seed = options.first_seed; seed < options.first_seed + seeds; ++seed)
        jobs.push_back({&family, value, static_cast<std::uint64_t>(seed)});
  }
  return jobs;
}

// The records of one case in one precision.
template <class T>
std::string records(const Job& job, const std::string& precision, const Options& options) {
  const Case c = job.family->make(job.value, job.seed);
  require_hinges_and_slides(*job.family, c.model);
  const Model<T> model = c.model.template cast<T>();
  const std::string begin = field(job.family->name) + ',' + number(job.value) + ',' +
                            std::to_string(model.nv()) + ',' + std::to_string(job.seed) + ',' +
                            precision + ',';
  std::string out;
  for (const std::string& variant : options.variants) {
    const auto solver = make_solver(variant, model);
    if (!solver)
      throw InputError("variant '" + variant + "' has no " + precision + ", or does not take '" +
                       job.family->name + "'");
    const Integration fall = free_fall(*solver, model, c.q, options.fall);
    out += begin + field(variant) + ',' + std::to_string(fall.calls) + ',' +
           (fall.finished ? '1' : '0') + ',' + number(fall.energy_drift) + '\n';
  }
  return out;
}

int run(Options options) {
  const std::vector<Family> all = all_families();
  options.variants = select(options.variants, variant_names(), "variant");
  const std::vector<Job> jobs = plan(all, options);
  OutputFile file(options.out);
  std::string text = "family,value,n,seed,precision,variant,calls,finished,energy_drift\n";
  Progress progress(static_cast<int>(jobs.size()));
  for (const Job& job : jobs) {
    progress.step(job.family->name + ' ' + number(job.value) + " seed " + std::to_string(job.seed));
    for (const std::string& precision : options.precisions)
      text += precision == "float32" ? records<float>(job, precision, options)
                                     : records<double>(job, precision, options);
  }
  file.write(text);
  return 0;
}

}  // namespace
}  // namespace kalmarm::stress

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("Calls of an adaptive integrator for a free fall, by variant, as CSV", "integrate");
  stress::Options options;
  app.add_option("--family", options.families,
                 "families of hinges and slides; a name that ends in * takes all that begin so")
      ->capture_default_str();
  app.add_option("--variant", options.variants, "variants, in the same way")->capture_default_str();
  app.add_option("--precision", options.precisions, "float32, float64 or both, of the variant")
      ->delimiter(',')
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  app.add_option("--seeds", options.seeds,
                 "N seeds of every case; default: 3, or 1 where the seed changes nothing")
      ->check(between(1, 10000000));
  app.add_option("--first-seed", options.first_seed, "the first of them")
      ->check(between(1, 1000000000))
      ->capture_default_str();
  auto* values = app.add_option("--values", options.values, "values of the family's parameter")
                     ->delimiter(',')
                     ->check(finite());
  app.add_option("--duration", options.fall.duration, "of the fall [s]")
      ->check(between(1e-6, 1e6))
      ->capture_default_str();
  app.add_option("--tolerance", options.fall.tolerance, "of a step, relative and absolute")
      ->check(between(1e-15, 1.0))
      ->capture_default_str();
  app.add_option("--cap", options.fall.cap, "calls after which a run is given up")
      ->check(between(1, 1000000000))
      ->capture_default_str();
  auto* quick = app.add_flag("--quick", options.quick, "few values (default)")->excludes(values);
  app.add_flag("--full", options.full, "every decade of a mass ratio, all values of others")
      ->excludes(quick)
      ->excludes(values);
  app.add_option("--out", options.out, "CSV file to write")->required();
  return run_program(app, argc, argv, [&] { return stress::run(options); });
}
