#include "accuracy/adversary/record.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "accuracy/programs/common/csv.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/state_file.hpp"
#include "robots/scene/write_mjcf.hpp"

namespace kalmarm::adversary {
namespace {

using nlohmann::json;

constexpr double least_progress = 0.02;  // log10: a row, 5 per cent

json list(const VectorX<double>& x) { return std::vector<double>(x.begin(), x.end()); }

}  // namespace

std::string csv_rows(const Asked& asked, const std::vector<Round>& rounds, const Verdict& verdict,
                     const Model<double>& model, const std::string& file) {
  const std::string begin = field(asked.of.variant) + ',' + asked.of.precision + ',' +
                            to_string(asked.of.task) + ',' + to_string(asked.of.goal) + ',' +
                            to_string(asked.of.kernel) + ',' + (asked.of.rows ? "1," : "0,") +
                            std::to_string(asked.seed) + ',' + asked.method() + ',';
  std::string out;
  double best = told;
  int before = 0;
  for (const Round& round : rounds) {
    for (const auto& [evaluations, value] : round.curve)
      if (value > best + least_progress) {
        best = value;
        out += begin + std::to_string(before + evaluations) + ',' + number(std::pow(10, value)) +
               ",,,,\n";
      }
    before += round.evaluations;
  }
  out += begin + std::to_string(before) + ',';
  best = best_of(rounds).value;
  if (best <= told) return out + ",,,,\n";
  return out + number(std::pow(10, best)) + ',' +
         (std::isnan(verdict.kS) ? "" : number(verdict.kS)) + ',' + std::to_string(model.nv()) +
         ',' + field(file) + ',' + outline(model) + '\n';
}

std::string outline(const Model<double>& model) {
  std::string out;
  std::vector<int> body_of(model.nv());  // of a link, counted from 1
  for (int k = 0, body = 1, dofs = 0; k < model.nv(); k += dofs, ++body) {
    const Joint<double>& joint = model.joint(k);
    const FileJoint in_file = file_joint(joint);
    dofs = in_file.dofs;
    std::fill_n(body_of.begin() + k, dofs, body);
    char text[120];
    std::snprintf(text, sizeof text, "%s%d %s %.3g %.3g %.3g", k == 0 ? "" : ";",
                  joint.parent < 0 ? 0 : body_of[joint.parent], in_file.type,
                  model.joint(k + dofs - 1).body.mass, joint.translation.norm(), joint.r);
    out += text;
  }
  return out;
}

std::string difference(const Model<double>& a, const Model<double>& b) {
  if (a.names() != b.names() || a.nq() != b.nq()) return "names of joints";
  if (a.gravity() != b.gravity()) return "gravity";
  for (int k = 0; k < a.nv(); ++k) {
    const Joint<double>&x = a.joint(k), &y = b.joint(k);
    const auto at = [&](const char* what) { return a.name(k) + ": " + what; };
    if (x.parent != y.parent) return at("parent");
    if (x.slides != y.slides || x.coordinate != y.coordinate || x.q_index != y.q_index)
      return at("kind of joint");
    if (x.ref != y.ref) return at("reference");
    if (x.rotation.coeffs() != y.rotation.coeffs()) return at("rotation");
    if (x.translation != y.translation) return at("translation");
    if (x.r != y.r) return at("armature");
    if (x.body.mass != y.body.mass) return at("mass");
    if (x.body.com != y.body.com) return at("centre of mass");
    if (x.body.axes.coeffs() != y.body.axes.coeffs()) return at("axes of inertia");
    if (x.body.moments != y.body.moments) return at("moments of inertia");
  }
  return "";
}

void write_find(const std::string& base, const Mechanism& mechanism) {
  const auto& [model, state] = mechanism;
  const std::string robot = base + ".xml", states = base + ".json";
  OutputFile(robot).write(to_mjcf(model, std::filesystem::path(base).filename().string()));
  const json entry = {{"qpos", list(state.q)}, {"qvel", list(state.qd)}, {"tau", list(state.tau)}};
  OutputFile(states).write(json{{"states", json::array({entry})}}.dump() + '\n');
  const Scene scene = load_scene(robot);
  if (const std::string what = difference(scene.model, model); !what.empty())
    throw InputError(robot + ": is read as another mechanism: " + what);
  const State read = read_states(scene, states).states[0];
  if (read.q != state.q || read.qd != state.qd || read.tau != state.tau)
    throw InputError(states + ": is read as another state");
}

}  // namespace kalmarm::adversary
