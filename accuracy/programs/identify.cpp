// identify: inertial parameters of a robot from measured or simulated motion -> JSON, MJCF.
//
// The fitted file is written where the fit is usable (identification.hpp). Exit 1 otherwise, with
// nothing written but the JSON, which says so.
#include <cstdio>

#include "accuracy/fits/fit_record.hpp"
#include "accuracy/fits/identification.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/ranges.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

std::string note_of(const Identification& done, const json& record) {
  char note[400];
  std::snprintf(note, sizeof note,
                "Fitted by identify: residual %s, %d samples, %d of %zu parameters seen by the "
                "data (the others are at the start's values), held-out torque NRMSE %.3g %%",
                record["residual"].get<std::string>().c_str(), done.train.count(),
                record["rank"].get<int>(), done.names.size(), 100 * done.after.total);
  return note;
}

int run(const IdentificationOptions& options) {
  OutputFile fitted(options.out), json_file = json_output(options.json_out),
                                  samples(options.samples_out);
  const Identification done = identify(options);
  if (!options.hidden.empty()) samples.write(to_csv(done.scene, done.train));
  const json record = record_of(done, options);
  const bool prints = options.json_out != "-";
  if (prints) print_record(record);
  json_file.write(record.dump(1) + "\n");
  if (!done.usable) return 1;
  if (options.out.empty()) return 0;
  fitted.write(fitted_file(done, note_of(done, record)));
  if (prints) std::printf("  wrote        %s\n", options.out.c_str());
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("Inertial parameters of a robot from measured or simulated motion.", "identify");
  IdentificationOptions o;
  o.read.adds_friction = true;  // of the file, where it is not fitted
  add_scene(app, o.robot, o.read)->required();
  app.add_option("--data", o.data, samples_help);
  app.add_option("--simulate", o.hidden, "SCENE of the hidden truth, which MuJoCo moves");
  app.add_option("--residual", o.fit.residual, "what is driven to zero")
      ->transform(CLI::CheckedTransformer(residuals))
      ->default_str("inverse_dynamics");
  app.add_option("--jacobian", o.fit.differentiation, "how it is differentiated")
      ->transform(CLI::CheckedTransformer(differentiations))
      ->default_str("analytic");
  o.free = {"bodies"};
  app.add_option("--free", o.free,
                 "bodies (all that are physical), names of bodies, armature, viscous, coulomb")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  app.add_option("--prior", o.fit.prior, "weight of the start's values against the data")
      ->check(not_negative())
      ->capture_default_str();
  app.add_option("--mass-within", o.fit.mass_within, "factor within which masses stay; 0: any")
      ->check(zero_or_above_one())
      ->capture_default_str();
  app.add_option("--com-within", o.fit.com_within,
                 "metres within which centres of mass stay; 0: anywhere")
      ->check(not_negative())
      ->capture_default_str();
  app.add_option("--iterations", o.fit.iterations, "at most, in a round")
      ->check(between(1, 100000))
      ->capture_default_str();
  app.add_option("--hold-out", o.hold_out, "share of --data that is predicted instead of fitted")
      ->check(between(0.01, 0.9))
      ->capture_default_str();
  app.add_option("--half-width", o.filter.half_width,
                 "samples on either side of one, to which the polynomials are fitted whose "
                 "derivatives stand in for what --data lacks")
      ->check(between(2, 10000))
      ->capture_default_str();
  app.add_option("--samples", o.simulation.count, "of --simulate")
      ->check(between(2, 1000000))
      ->capture_default_str();
  app.add_option("--period", o.simulation.period, "of the simulated motion [s]")
      ->check(positive())
      ->capture_default_str();
  app.add_option("--speed", o.simulation.speed, "largest joint speed of it [rad/s]")
      ->check(positive())
      ->capture_default_str();
  app.add_option("--noise", o.simulation.noise, "of simulated torques, against their own size")
      ->check(not_negative())
      ->capture_default_str();
  app.add_option("--start-error", o.start_error,
                 "by which SCENE's masses, centres and moments are moved before the fit")
      ->check(between(0.0, 0.9))
      ->capture_default_str();
  app.add_option("--seed", o.simulation.seed, "of motion, noise and start error")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--out", o.out, "MJCF file of the fitted robot");
  app.add_option("--json", o.json_out, std::string("all results: ") + json_help);
  app.add_option("--samples-out", o.samples_out, "CSV file for the simulated samples");
  return run_program(app, argc, argv, [&] { return run(o); });
}
