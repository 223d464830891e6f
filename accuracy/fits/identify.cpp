// identify: inertial parameters of a robot from measured or simulated motion -> JSON, MJCF.
//
// --simulate makes the data with MuJoCo from a hidden model: torques (and mass matrices) along an
// optimised trajectory, with noise; the last fifth is along another, random one, and is held out.
// Of --data the last fifth is held out. The fitted file is written where the fit is usable: the
// solver ended well and the error of held-out torques is at most a tenth above the start's. Exit 1
// otherwise, with nothing written but the JSON, which says so.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "accuracy/fits/differentiate.hpp"
#include "accuracy/fits/fit.hpp"
#include "accuracy/fits/identifiability.hpp"
#include "accuracy/fits/prediction.hpp"
#include "accuracy/fits/samples.hpp"
#include "accuracy/fits/simulated_samples.hpp"
#include "accuracy/fits/start.hpp"
#include "accuracy/programs/command_line.hpp"
#include "accuracy/programs/open_scene.hpp"
#include "accuracy/programs/output_file.hpp"
#include "robots/fitted_model.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

const std::map<std::string, Residual> residuals{{"inverse_dynamics", Residual::inverse_dynamics},
                                                {"forward_dynamics", Residual::forward_dynamics},
                                                {"innovations", Residual::innovations},
                                                {"mass_matrix", Residual::mass_matrix},
                                                {"likelihood", Residual::likelihood}};
const std::map<std::string, Differentiation> differentiations{
    {"analytic", Differentiation::analytic},
    {"automatic", Differentiation::automatic},
    {"numeric", Differentiation::numeric}};

template <class Value>
std::string name_of(const std::map<std::string, Value>& names, Value value) {
  for (const auto& [name, is] : names)
    if (is == value) return name;
  return {};
}

struct Options {
  std::string robot, data, hidden, out, json_out, samples_out;
  LoadOptions read;
  std::vector<std::string> free;
  FitOptions fit;
  SimulationOptions simulation;
  double start_error = 0, hold_out = 0.2;
};

json to_json(const VectorX<double>& x) {
  json out = json::array();
  for (const double value : x) out.push_back(std::isfinite(value) ? json(value) : json(nullptr));
  return out;
}

json picked(const std::vector<int>& columns, const std::vector<std::string>& names) {
  json out = json::array();
  for (const int column : columns) out.push_back(names[column]);
  return out;
}

std::string joined(const json& names, std::size_t most = 8) {
  std::string out;
  for (std::size_t i = 0; i < std::min(most, names.size()); ++i)
    out += (i ? ", " : "") + names[i].get<std::string>();
  if (names.size() > most) out += ", and " + std::to_string(names.size() - most) + " more";
  return out;
}

class Identification {
 public:
  explicit Identification(const Options& options)
      : options_(options), scene_(open_scene(options.robot, options.read)) {
    if (options.data.empty() == options.hidden.empty())
      throw InputError("one of --data and --simulate is needed, and not both");
    if (options.fit.residual == Residual::mass_matrix && options.hidden.empty())
      throw InputError("--residual mass_matrix: mass matrices are known only with --simulate");
    if (!options.out.empty() && scene_.file.empty())
      throw InputError("--out: " + scene_.name + " has no file that could be written again");
    for (int k = 0; k < scene_.model.nv(); ++k) bodies_.push_back(link_name(scene_, k));
    free_ = free_parameters(options.free, scene_.model, bodies_);
    note_held_bodies();
    if (free_.columns() == 0) throw InputError("--free: nothing is left to fit");
    names_ = column_names(free_, bodies_, scene_.model.names());
    start_ = mechanics_of(scene_);
    if (!options.hidden.empty()) simulate();
    if (!options.data.empty()) read();
    check_physical(start_, free_, bodies_, scene_.name);
    if (options.start_error > 0) spoil(free_, options.start_error, options.simulation.seed, start_);
  }

  int run() {
    const Fit result = fit(start_, free_, train_, options_.fit);
    const bool usable = judge(result);
    report(result, usable);
    if (prints()) print(usable);
    if (!options_.json_out.empty()) write_json(options_.json_out, record_.dump(1) + "\n");
    if (!usable) return 1;
    if (!options_.out.empty()) save(result);
    return 0;
  }

 private:
  // Bodies that "bodies" leaves out.
  void note_held_bodies() const {
    if (std::find(options_.free.begin(), options_.free.end(), "bodies") == options_.free.end())
      return;
    for (int k = 0; k < scene_.model.nv(); ++k)
      if (!scene_.model.inertia(k).massless &&
          std::find(free_.bodies.begin(), free_.bodies.end(), k) == free_.bodies.end())
        add_note(options_.robot + ": body '" + bodies_[k] + "' is not physical and not fitted");
  }

  bool prints() const { return options_.json_out != "-"; }

  void simulate() {
    const Scene hidden = open_scene(options_.hidden, options_.read);
    truth_ = mechanics_of(hidden);
    check_same_joints(scene_, hidden);
    check_physical(*truth_, free_, bodies_, hidden.name);
    const SimulatedSamples simulated = simulate_samples(hidden, options_.simulation);
    train_ = simulated.train;
    test_ = simulated.test;
    if (!options_.samples_out.empty()) write_file(options_.samples_out, to_csv(scene_, train_));
  }

  void read() {
    Samples all = read_samples(scene_, options_.data);
    if (!all.has_accelerations()) differentiate(all);
    const int held_out = static_cast<int>(options_.hold_out * all.count());
    if (all.count() - held_out < 1 || held_out < 1)
      throw InputError(options_.data + ": " + std::to_string(all.count()) +
                       " samples are too few to hold some out");
    train_ = part(all, 0, all.count() - held_out);
    test_ = part(all, all.count() - held_out, held_out);
  }

  bool judge(const Fit& result) {
    before_ = torque_error(start_, test_);
    if (!result.usable) return false;
    after_ = torque_error(result.robot, test_);
    return after_.total <= 1.1 * before_.total + 1e-6;  // a start that is right already is as good
  }

  void report(const Fit& result, bool usable) {
    record_ = {{"robot", scene_.name},
               {"residual", name_of(residuals, options_.fit.residual)},
               {"jacobian", name_of(differentiations, options_.fit.differentiation)},
               {"samples", train_.count()},
               {"held_out", test_.count()},
               {"usable", usable},
               {"solver", result.message},
               {"seconds", result.seconds},
               {"columns", names_},
               {"warnings", json::array()}};
    if (truth_) record_["noise"] = options_.simulation.noise;
    add_iterations(result);
    if (!result.converged)
      record_["warnings"].push_back("the solver has not converged: " + result.message);
    if (!result.usable) return;
    record_["residual_rms"] = result.sigma;
    record_["values"] = to_json(free_.values_of(result.robot));
    record_["start"] = to_json(free_.values_of(start_));
    if (truth_) record_["truth"] = to_json(free_.values_of(*truth_));
    record_["torque_nrmse"] = {
        {"start", before_.total}, {"fitted", after_.total}, {"joints", to_json(after_.joints)}};
    add_prediction(result);
    add_identifiability(result);
    add_physics(result);
  }

  void add_iterations(const Fit& result) {
    json& out = record_["iterations"] = json::array();
    for (const Iteration& it : result.iterations)
      out.push_back({{"round", it.round},
                     {"cost", it.cost},
                     {"gradient", it.gradient},
                     {"seconds", it.seconds}});
  }

  void add_prediction(const Fit& result) {
    const int shown = std::min(400, test_.count());
    const Samples few = part(test_, 0, shown);
    const MatrixX<double> fitted = torques(result.robot, few), start = torques(start_, few);
    json& out = record_["prediction"] = {{"time", to_json(few.time)}, {"joints", json::array()}};
    for (int k = 0; k < scene_.model.nv(); ++k)
      out["joints"].push_back({{"name", scene_.model.name(k)},
                               {"measured", to_json(few.tau.row(k))},
                               {"fitted", to_json(fitted.row(k))},
                               {"start", to_json(start.row(k))}});
  }

  void add_identifiability(const Fit& result) {
    const VectorX<double> units = column_units(start_, free_);
    const BaseParameters base = base_parameters(result.R, units);
    const std::vector<std::string> words = in_words(base, names_);
    const Lost lost = lost_parameters(scene_, start_, free_, options_.fit.residual, result.R);
    record_["rank"] = base.rank;
    record_["condition"] = base.condition;
    record_["unseen"] = picked(base.unseen, names_);
    record_["alone"] = picked(base.alone, names_);
    record_["rank_of_random_motion"] = lost.rank;
    record_["lost"] = picked(lost.columns, names_);
    if (lost.rank > base.rank)
      record_["warnings"].push_back("too little excitation: the data see " +
                                    std::to_string(base.rank) + " of " + std::to_string(lost.rank) +
                                    " base parameters; lost: " + joined(record_["lost"]));
    if (base.condition * base.condition > 1e12)
      record_["warnings"].push_back(
          "cond(J'J) is above 1e12: small errors of the data move the "
          "parameters a long way");
    const VectorX<double> fitted = base.map * free_.values_of(result.robot);
    const VectorX<double> deviation =
        (base.map * result.covariance * base.map.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
    std::optional<VectorX<double>> truth;
    if (truth_) truth = base.map * free_.values_of(*truth_);
    json& out = record_["base_parameters"] = json::array();
    for (int i = 0; i < base.rank; ++i) {
      json entry{{"name", words[i]},
                 {"unit", units[base.columns[i]]},
                 {"fitted", fitted[i]},
                 {"low", fitted[i] - 1.96 * deviation[i]},
                 {"high", fitted[i] + 1.96 * deviation[i]}};
      if (truth) entry["true"] = (*truth)[i];
      out.push_back(entry);
    }
    if (!truth) return;
    const auto worst = [&](const VectorX<double>& values) {
      double error = 0;
      for (int i = 0; i < base.rank; ++i)
        error = std::max(error, std::abs(values[i] - (*truth)[i]) /
                                    std::max(std::abs((*truth)[i]), units[base.columns[i]]));
      return error;
    };
    record_["base_error"] = worst(fitted);
    record_["base_error_of_start"] = worst(base.map * free_.values_of(start_));
    for (std::size_t i = 0; i < result.iterations.size(); ++i)
      record_["iterations"][i]["base_error"] = worst(base.map * result.iterations[i].values);
  }

  void add_physics(const Fit& result) {
    json& out = record_["pseudo_inertia"] = json::array();
    for (const int k : free_.bodies) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(
          pseudo_inertia(result.robot.model.M(k)));
      out.push_back({{"body", bodies_[k]}, {"smallest_eigenvalue", eigen.eigenvalues()[0]}});
    }
  }

  void print(bool usable) const {
    std::printf("%s, residual %s, %s Jacobian, %d samples, %d held out\n", scene_.name.c_str(),
                record_["residual"].get<std::string>().c_str(),
                record_["jacobian"].get<std::string>().c_str(), train_.count(), test_.count());
    std::printf("  fit          %zu iterations, %.2f s: %s\n", record_["iterations"].size(),
                record_["seconds"].get<double>(), record_["solver"].get<std::string>().c_str());
    if (record_.contains("rank")) {
      std::printf(
          "  data see     %d base parameters of %zu parameters (random motion: %d), cond(J) %.3g\n",
          record_["rank"].get<int>(), names_.size(), record_["rank_of_random_motion"].get<int>(),
          record_["condition"].get<double>());
      if (!record_["unseen"].empty())
        std::printf("  kept         at the start, since the data do not see them: %s\n",
                    joined(record_["unseen"]).c_str());
      if (record_.contains("base_error"))
        std::printf(
            "  error        of the base parameters at most %.2g of the truth (start: %.2g)\n",
            record_["base_error"].get<double>(), record_["base_error_of_start"].get<double>());
      std::printf("  held out     torque NRMSE %.3g %% (start: %.3g %%)\n", 100 * after_.total,
                  100 * before_.total);
    }
    for (const json& warning : record_["warnings"])
      std::printf("  warning      %s\n", warning.get<std::string>().c_str());
    if (!usable) std::printf("  NOT USABLE   nothing is written\n");
  }

  void save(const Fit& result) {
    FittedParameters fitted;
    for (const int k : free_.bodies) fitted.inertia[k] = result.robot.model.M(k);
    for (const int k : free_.armature) fitted.armature[k] = result.robot.model.joint(k).r;
    for (const int k : free_.viscous) fitted.viscous[k] = result.robot.viscous[k];
    for (const int k : free_.coulomb) fitted.coulomb[k] = result.robot.coulomb[k];
    char note[400];
    std::snprintf(note, sizeof note,
                  "Fitted by identify: residual %s, %d samples, %d of %zu parameters seen by the "
                  "data (the others are at the start's values), held-out torque NRMSE %.3g %%",
                  record_["residual"].get<std::string>().c_str(), train_.count(),
                  record_["rank"].get<int>(), names_.size(), 100 * after_.total);
    write_file(options_.out, save_fitted(scene_.file, fitted, note, scene_.read));
    if (prints()) std::printf("  wrote        %s\n", options_.out.c_str());
  }

  Options options_;
  Scene scene_;
  std::vector<std::string> bodies_, names_;
  FreeParameters free_;
  Mechanics<double> start_;
  std::optional<Mechanics<double>> truth_;
  Samples train_, test_;
  TorqueError before_, after_;
  json record_;
};

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("Inertial parameters of a robot from measured or simulated motion.", "identify");
  Options o;
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
      ->capture_default_str();
  app.add_option("--prior", o.fit.prior, "weight of the start's values against the data")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--mass-within", o.fit.mass_within, "factor within which masses stay; 0: any")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--com-within", o.fit.com_within,
                 "metres within which centres of mass stay; 0: anywhere")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--iterations", o.fit.iterations, "at most, in a round")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--hold-out", o.hold_out, "share of --data that is predicted instead of fitted")
      ->check(CLI::Range(0.01, 0.9))
      ->capture_default_str();
  app.add_option("--samples", o.simulation.count, "of --simulate")
      ->check(CLI::Range(2, 1000000))
      ->capture_default_str();
  app.add_option("--period", o.simulation.period, "of the simulated motion [s]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--speed", o.simulation.speed, "largest joint speed of it [rad/s]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--noise", o.simulation.noise, "of simulated torques, against their own size")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--start-error", o.start_error,
                 "by which SCENE's masses, centres and moments are moved before the fit")
      ->check(CLI::Range(0.0, 0.9))
      ->capture_default_str();
  app.add_option("--seed", o.simulation.seed, "of motion, noise and start error")
      ->capture_default_str();
  app.add_option("--out", o.out, "MJCF file of the fitted robot");
  app.add_option("--json", o.json_out, std::string("all results: ") + json_help);
  app.add_option("--samples-out", o.samples_out, "CSV file for the simulated samples");
  return run_program(app, argc, argv, [&] { return Identification(o).run(); });
}
