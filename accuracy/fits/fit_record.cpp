#include "accuracy/fits/fit_record.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "accuracy/fits/identifiability.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

template <class Value>
std::string name_of(const std::map<std::string, Value>& names, Value value) {
  for (const auto& [name, is] : names)
    if (is == value) return name;
  return {};
}

json to_json(const VectorX<double>& x) {
  json out = json::array();
  for (const double value : x) out.push_back(std::isfinite(value) ? json(value) : json(nullptr));
  return out;
}

// A fit in the frames of the file's bodies (identifiability.hpp).
struct InFileFrames {
  MatrixX<double> B, R, covariance;
  VectorX<double> units;
  BaseParameters base;

  explicit InFileFrames(const Identification& done)
      : B(columns_of_file(done.scene, done.free)),
        R(done.fit.R * B.inverse()),
        covariance(B * done.fit.covariance * B.transpose()),
        units(column_units(done.start, done.free)),
        base(base_parameters(R, units)) {}

  VectorX<double> values(const Identification& done, const Mechanics<double>& robot) const {
    return B * done.free.values_of(robot);
  }
};

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

void add_iterations(const Fit& result, json& record) {
  json& out = record["iterations"] = json::array();
  for (const Iteration& it : result.iterations)
    out.push_back({{"round", it.round},
                   {"cost", it.cost},
                   {"gradient", it.gradient},
                   {"seconds", it.seconds}});
}

void add_prediction(const Identification& done, json& record) {
  const int shown = std::min(400, done.test.count());
  const Samples few = part(done.test, 0, shown);
  const MatrixX<double> fitted = torques(done.fit.robot, few), start = torques(done.start, few);
  json& out = record["prediction"] = {{"time", to_json(few.time)}, {"joints", json::array()}};
  for (int k = 0; k < done.scene.model.nv(); ++k)
    out["joints"].push_back({{"name", done.scene.model.name(k)},
                             {"measured", to_json(few.tau.row(k))},
                             {"fitted", to_json(fitted.row(k))},
                             {"start", to_json(start.row(k))}});
}

// What the data see, and what other motion would show.
void add_identifiability(const Identification& done, const InFileFrames& in_file, Residual residual,
                         json& record) {
  const BaseParameters& base = in_file.base;
  const Lost lost = lost_parameters(done.scene, done.start, done.free, residual, in_file.R);
  const VectorX<double> moved =
      in_file.values(done, done.fit.robot) - in_file.values(done, done.start);
  std::vector<int> kept;
  for (const int column : base.unseen)
    if (std::abs(moved[column]) <= 1e-9 * in_file.units[column]) kept.push_back(column);
  record["rank"] = base.rank;
  record["condition"] = base.condition;
  record["unseen"] = picked(base.unseen, done.names);
  record["kept"] = picked(kept, done.names);
  record["alone"] = picked(base.alone, done.names);
  record["rank_of_random_motion"] = lost.rank;
  record["lost"] = picked(lost.columns, done.names);
  if (lost.rank > base.rank)
    record["warnings"].push_back("too little excitation: the data see " +
                                 std::to_string(base.rank) + " of " + std::to_string(lost.rank) +
                                 " base parameters; lost: " + joined(record["lost"]));
  if (base.condition * base.condition > 1e12)
    record["warnings"].push_back(
        "cond(J'J) is above 1e12: small errors of the data move the "
        "parameters a long way");
}

void add_base_parameters(const Identification& done, const InFileFrames& in_file, json& record) {
  const BaseParameters& base = in_file.base;
  const VectorX<double>& units = in_file.units;
  const std::vector<std::string> words = in_words(base, done.names);
  const VectorX<double> fitted = base.map * in_file.values(done, done.fit.robot);
  const VectorX<double> deviation =
      (base.map * in_file.covariance * base.map.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
  std::optional<VectorX<double>> truth;
  if (done.truth) truth = base.map * in_file.values(done, *done.truth);
  json& out = record["base_parameters"] = json::array();
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
  record["base_error"] = worst(fitted);
  record["base_error_of_start"] = worst(base.map * in_file.values(done, done.start));
  for (std::size_t i = 0; i < done.fit.iterations.size(); ++i)
    record["iterations"][i]["base_error"] =
        worst(base.map * (in_file.B * done.fit.iterations[i].values));
}

void add_physics(const Identification& done, json& record) {
  json& out = record["pseudo_inertia"] = json::array();
  for (const int k : done.free.bodies) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(
        pseudo_inertia(done.fit.robot.model.M(k)));
    out.push_back({{"body", done.bodies[k]}, {"smallest_eigenvalue", eigen.eigenvalues()[0]}});
  }
}

}  // namespace

json record_of(const Identification& done, const IdentificationOptions& options) {
  const Fit& result = done.fit;
  json record{{"robot", done.scene.name},
              {"residual", name_of(residuals, options.fit.residual)},
              {"jacobian", name_of(differentiations, options.fit.differentiation)},
              {"samples", done.train.count()},
              {"held_out", done.test.count()},
              {"usable", done.usable},
              {"solver", result.message},
              {"seconds", result.seconds},
              {"columns", done.names},
              {"known", done.known},
              {"warnings", done.findings}};
  if (done.truth) record["noise"] = options.simulation.noise;
  add_iterations(result, record);
  if (!result.converged && !result.message.empty())
    record["warnings"].push_back("the solver has not converged: " + result.message);
  if (!result.usable) return record;
  record["residual_rms"] = result.sigma;
  const InFileFrames in_file(done);
  record["values"] = to_json(in_file.values(done, result.robot));
  record["start"] = to_json(in_file.values(done, done.start));
  if (done.truth) record["truth"] = to_json(in_file.values(done, *done.truth));
  record["torque_nrmse"] = {{"start", done.before.total},
                            {"fitted", done.after.total},
                            {"joints", to_json(done.after.joints)}};
  add_prediction(done, record);
  add_identifiability(done, in_file, options.fit.residual, record);
  add_base_parameters(done, in_file, record);
  add_physics(done, record);
  return record;
}

void print_record(const json& record) {
  const auto text = [&](const char* key) { return record[key].get<std::string>(); };
  const auto number = [](const json& value) { return value.get<double>(); };
  std::printf("%s, residual %s, %s Jacobian, %d samples, %d held out\n", text("robot").c_str(),
              text("residual").c_str(), text("jacobian").c_str(), record["samples"].get<int>(),
              record["held_out"].get<int>());
  std::printf("  known        of the file: %s\n", joined(record["known"]).c_str());
  std::printf("  fit          %zu iterations, %.2f s: %s\n", record["iterations"].size(),
              number(record["seconds"]), text("solver").c_str());
  if (record.contains("rank")) {
    std::printf(
        "  data see     %d base parameters of %zu parameters (random motion: %d), cond(J) %.3g\n",
        record["rank"].get<int>(), record["columns"].size(),
        record["rank_of_random_motion"].get<int>(), number(record["condition"]));
    json seen = json::array();
    for (const json& one : record["base_parameters"]) seen.push_back(one["name"]);
    std::printf("  these        in the frames of the file's bodies: %s\n", joined(seen).c_str());
    if (!record["unseen"].empty())
      std::printf("  not seen     by themselves or in a sum: %s\n",
                  joined(record["unseen"]).c_str());
    if (!record["kept"].empty())
      std::printf("  kept         at the start: %s\n", joined(record["kept"]).c_str());
    if (record.contains("base_error"))
      std::printf("  error        of the base parameters at most %.2g of the truth (start: %.2g)\n",
                  number(record["base_error"]), number(record["base_error_of_start"]));
    const json& error = record["torque_nrmse"];
    std::printf("  held out     torque NRMSE %.3g %% (start: %.3g %%)\n",
                100 * number(error["fitted"]), 100 * number(error["start"]));
  }
  for (const json& warning : record["warnings"])
    std::printf("  warning      %s\n", warning.get<std::string>().c_str());
  if (!record["usable"].get<bool>()) std::printf("  NOT USABLE   nothing is written\n");
}

}  // namespace kalmarm
