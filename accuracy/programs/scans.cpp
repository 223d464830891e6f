// scans: errors of the filter as a scan, by size of blocks and order of combination
// (scan/scan_errors.hpp), or what it costs on any number of processors (scan/scan_cost.hpp) -> one
// CSV.
#include <algorithm>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/csv.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/scan/scan_cost.hpp"
#include "accuracy/scan/scan_errors.hpp"
#include "accuracy/stress/selection.hpp"

namespace kalmarm::stress {
namespace {

constexpr int longest = 1'000'000;

struct Options {
  std::vector<std::string> families = {"straight", "random_chain", "heavy_tip"};
  std::vector<std::string> precisions = {"float64"};
  std::vector<double> values;
  std::vector<int> links = {4, 16, 64};
  int seeds = 1, first_seed = 1;
  bool cost = false;
  std::string out;
};

int run(const Options& options) {
  const std::vector<Family> all = all_families();
  std::vector<Family> chosen;
  for (const std::string& name : select(options.families, names_of(all), "family"))
    chosen.push_back(*std::ranges::find(all, name, &Family::name));
  const auto values_of = [&](const Family& family) {
    return options.values.empty() ? family.quick : options.values;
  };
  int cases = 0;
  for (const Family& family : chosen) {
    cases += static_cast<int>(values_of(family).size()) * options.seeds;
    for (const double value : values_of(family))
      if (family.parameter == "N" && !(value >= 1 && value <= longest))
        throw InputError("family '" + family.name + "': N = " + number(value) +
                         " is not from 1 to " + std::to_string(longest));
  }
  OutputFile file(options.out);
  std::string text = options.cost ? scan_cost::csv_header : scan_errors::csv_header;
  Progress progress(cases);
  for (const Family& family : chosen)
    for (const double value : values_of(family))
      for (int seed = options.first_seed; seed < options.first_seed + options.seeds; ++seed) {
        const std::string name =
            family.name + ' ' + number(value) + " seed " + std::to_string(seed);
        progress.step(name);
        if (options.cost) {
          text += scan_cost::rows(family, value, seed, options.links);
          continue;
        }
        for (const std::string& precision : options.precisions)
          text += scan_errors::rows(family, value, seed, precision, options.links);
      }
  file.write(text);
  return 0;
}

}  // namespace
}  // namespace kalmarm::stress

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("Errors of the filter as a scan against truth, or its cost in flops, as CSV",
               "scans");
  stress::Options options;
  app.add_option("--family", options.families,
                 "families of the laboratory; a name that ends in * takes all that begin so")
      ->capture_default_str();
  app.add_option("--values", options.values, "values of the family's parameter")
      ->delimiter(',')
      ->check(finite());
  app.add_option("--links", options.links, "sizes of blocks")
      ->delimiter(',')
      ->check(between(1, 1000000))
      ->capture_default_str();
  app.add_option("--precision", options.precisions, "float32, float64 or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  app.add_option("--seeds", options.seeds, "N seeds of every case")
      ->check(between(1, 10000000))
      ->capture_default_str();
  app.add_option("--first-seed", options.first_seed, "the first of them")
      ->check(between(1, 1000000000))
      ->capture_default_str();
  app.add_flag("--cost", options.cost,
               "flops on 1 to 10000 processors instead of errors, counted one by one");
  app.add_option("--out", options.out, "CSV file to write")->required();
  return run_program(app, argc, argv, [&] { return stress::run(options); });
}
