// plan: what is in a scene, what a question needs of it, what is left out and by which rule.
//
// With --tolerance also the precision that is enough, as `evaluate --variant auto` chooses it, for
// random states of the scene.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "accuracy/contenders/advice.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/fast/lowering/zero_terms.hpp"
#include "algorithms/study/flops/flops.hpp"
#include "robots/loader/names.hpp"
#include "robots/scene/inventory.hpp"
#include "robots/scene/question.hpp"
#include "robots/scene/sites.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

struct Options {
  std::string scene;
  LoadOptions read;
  QuestionOptions question;
  std::optional<double> tolerance;
  int random = 200;
  std::uint64_t seed = 1;
  std::string json_file;
  bool frames = false;
};

// What a rule leaves out, of so many DoF.
std::string meaning(const Plan& plan, const Acted& acted) {
  const std::string count = std::to_string(acted.dofs.size());
  const auto parts = [&](Kernel kernel) {
    return std::to_string(std::count_if(plan.parts.begin(), plan.parts.end(),
                                        [&](const Part& part) { return part.kernel == kernel; }));
  };
  switch (acted.rule) {
    case Rule::locked_joints:
      return count + " DoF stand still: their links are one body with their parents";
    case Rule::untouched_trees:
      return count + " DoF in trees that are not asked about";
    case Rule::massless_branches:
      return count + " DoF that move no inertia and are not asked about";
    case Rule::separate_trees:
      return std::to_string(plan.parts.size()) + " trees are solved apart";
    case Rule::translations:
      return parts(Kernel::translational) + " tree(s) of slides alone: no angles, constant factors";
    case Rule::zero_terms:
      return "turns by zero or right angles between " + count + " axes and those before";
    case Rule::rest:
      return "velocities and bias forces";
    case Rule::partial_answers:
      return "what is not asked for of M^-1";
  }
  return "";
}

// What is left, and what of its constant screws is zero and needs no sums (zero_terms.hpp).
json left(const Plan& plan) {
  int dofs = 0, noise = 0, massless = 0;
  ZeroTerms zeros;
  for (const Part& part : plan.parts) {
    const Model<double>& model = part.reduction.model;
    for (int k = 0; k < model.nv(); ++k) {
      ++dofs;
      noise += model.joint(k).r > 0;
      massless += model.joint(k).body.massless();
    }
    if (part.kernel != Kernel::spatial && part.kernel != Kernel::spatial_at_rest) continue;
    const ZeroTerms own = count_zero_terms(LoweredModel<double>(model, part.zeros));
    zeros.parallel += own.parallel;
    zeros.right_angles += own.right_angles;
    zeros.meeting += own.meeting;
    zeros.without_offset += own.without_offset;
  }
  return {{"dofs", dofs},
          {"with_armature", noise},
          {"massless_links", massless},
          {"zero_terms",
           {{"parallel_axes", zeros.parallel},
            {"right_angles", zeros.right_angles},
            {"axes_that_meet", zeros.meeting},
            {"no_offset", zeros.without_offset}}}};
}

json flops_before_and_after(const Plan& pruned, const Plan& whole) {
  json out;
  for (const Want want : pruned.question.want)
    out[to_string(want)] = {{"before", flops(whole, want)}, {"after", flops(pruned, want)}};
  return out;
}

json precision(const Options& options, const Scene& scene, const Question& question) {
  std::vector<State> states = random_states(scene, options.random, options.seed);
  for (State& state : states) state = asked_state(scene, question, std::move(state));
  const auto advisor = make_advisor(scene, options.question, question, states);
  const Advice advice = advise(*advisor, *options.tolerance);
  const Candidate& chosen = advisor->candidates()[advice.candidate];
  const Observation& seen = advisor->observe(advice.candidate);
  return {{"tolerance", *options.tolerance},   {"precision", to_string(chosen.precision)},
          {"variant", chosen.variant},         {"worst_error", seen.worst},
          {"predicted_error", seen.predicted}, {"enough", advice.enough},
          {"reason", advice.reason},           {"states", options.random}};
}

// What --site knows: where it stands in the axes of the last link of a DoF, or of the world.
json frames_of(const Scene& scene) {
  json out = json::array();
  for (const auto& [name, at] : sites_of(scene))
    out.push_back(
        {{"name", name},
         {"dof", at.link < 0 ? json(nullptr) : json(scene.model.name(at.link))},
         {"translation", {at.translation.x(), at.translation.y(), at.translation.z()}},
         {"rotation", {at.rotation.w(), at.rotation.x(), at.rotation.y(), at.rotation.z()}}});
  return out;
}

json describe(const Options& options, const Scene& scene) {
  const Question question = question_of(scene, options.question);
  const Plan plan = make_plan(scene.model, question, rules_of(options.question));
  const Plan whole = make_plan(scene.model, question, {});
  const auto names = [&](const std::vector<int>& dofs) {
    json out = json::array();
    for (const int k : dofs) out.push_back(scene.model.name(k));
    return out;
  };

  json out = {{"robot", scene.name}, {"nv", scene.model.nv()}};
  const Inventory inventory = inventory_of(scene);
  out["bodies"] = {{"all", inventory.bodies},
                   {"moving", inventory.moving},
                   {"welded", inventory.welded},
                   {"fixed", inventory.fixed}};
  out["elements"] = json::array();
  for (const Inventory::Element& element : inventory.elements)
    out["elements"].push_back(
        {{"kind", element.kind}, {"in_file", element.given}, {"needed", element.kept}});
  for (const Want want : question.want) out["want"].push_back(to_string(want));
  out["asked"] = names(plan.asked);
  out["locked"] = names(question.locked);
  if (!options.question.sites.empty()) out["sites"] = options.question.sites;
  out["rules"] = json::array();
  for (const Acted& acted : plan.acted)
    out["rules"].push_back({{"rule", to_string(acted.rule)},
                            {"meaning", meaning(plan, acted)},
                            {"dofs", names(acted.dofs)}});
  out["parts"] = json::array();
  for (const Part& part : plan.parts)
    out["parts"].push_back(
        {{"kernel", to_string(part.kernel)}, {"dofs", names(part.reduction.dofs)}});
  out["singular"] = names(plan.singular);
  out["left"] = left(plan);
  out["flops"] = flops_before_and_after(plan, whole);
  if (options.frames) out["frames"] = frames_of(scene);
  if (options.tolerance) out["precision"] = precision(options, scene, question);
  return out;
}

// "31 geoms, 2 lights", of the elements whose number by `count` is not zero.
template <class Count>
std::string listed(const json& elements, const Count& count) {
  std::string out;
  for (const json& element : elements)
    if (const int n = count(element); n > 0)
      out += (out.empty() ? "" : ", ") + counted(n, element["kind"]);
  return out.empty() ? "nothing" : out;
}

std::string shortened(const json& names) {
  constexpr std::size_t shown = 6;
  std::string out;
  for (std::size_t i = 0; i < std::min(names.size(), shown); ++i)
    out += (i == 0 ? "" : ", ") + names[i].get<std::string>();
  return names.size() > shown ? out + " ... (" + std::to_string(names.size()) + ")" : out;
}

void print(const json& plan) {
  const auto line = [](const char* what, const std::string& text) {
    std::printf("%-12s%s\n", what, text.c_str());
  };
  const json& bodies = plan["bodies"];
  char text[200];
  std::snprintf(
      text, sizeof text, "%s: %d DoF; %d bodies: %d with joints, %d welded to others, %d fixed",
      plan["robot"].get<std::string>().c_str(), plan["nv"].get<int>(), bodies["all"].get<int>(),
      bodies["moving"].get<int>(), bodies["welded"].get<int>(), bodies["fixed"].get<int>());
  line("scene", text);
  const json& elements = plan["elements"];
  line("not needed", listed(elements, [](const json& e) {
         return e["in_file"].get<int>() - e["needed"].get<int>();
       }));
  line("needed", listed(elements, [](const json& e) { return e["needed"].get<int>(); }));
  std::string want;
  for (const json& word : plan["want"])
    want += (want.empty() ? "" : ", ") + word.get<std::string>();
  line("asked", want + (plan["asked"].empty() ? "" : " of " + shortened(plan["asked"])));
  if (!plan["locked"].empty()) line("locked", shortened(plan["locked"]));
  if (plan.contains("sites")) line("sites", shortened(plan["sites"]));
  for (const json& rule : plan["rules"])
    line("left out", rule["meaning"].get<std::string>() + " (" + rule["rule"].get<std::string>() +
                         "): " + shortened(rule["dofs"]));
  if (plan["rules"].empty()) line("left out", "nothing");
  std::snprintf(text, sizeof text, "%d DoF in %zu part(s), %d with armature, %d massless links",
                plan["left"]["dofs"].get<int>(), plan["parts"].size(),
                plan["left"]["with_armature"].get<int>(),
                plan["left"]["massless_links"].get<int>());
  line("left", text);
  const json& zeros = plan["left"]["zero_terms"];
  std::snprintf(text, sizeof text,
                "links whose axes are parallel to the parent's %d, at a right angle %d, meet it %d",
                zeros["parallel_axes"].get<int>(), zeros["right_angles"].get<int>(),
                zeros["axes_that_meet"].get<int>());
  line("", text);
  if (!plan["singular"].empty())
    line("singular", shortened(plan["singular"]) + " move no inertia: M has no inverse");
  for (const auto& [task, count] : plan["flops"].items()) {
    const double before = count["before"], after = count["after"];
    std::snprintf(text, sizeof text, "%s: %.3g before, %.3g after, %.2g times fewer", task.c_str(),
                  before, after, before / after);
    line("flops", text);
  }
  for (const json& frame : plan.value("frames", json::array())) {
    const json& p = frame["translation"];
    std::snprintf(text, sizeof text, " at (%.6g, %.6g, %.6g) m of ", p[0].get<double>(),
                  p[1].get<double>(), p[2].get<double>());
    line("frame", frame["name"].get<std::string>() + text +
                      (frame["dof"].is_null() ? "the world" : frame["dof"].get<std::string>()));
  }
  if (!plan.contains("precision")) return;
  line("precision", plan["precision"]["reason"]);
}

int run(const Options& options) {
  const Scene scene = open_scene(options.scene, options.read);
  OutputFile file = json_output(options.json_file);
  const json plan = describe(options, scene);
  if (options.json_file != "-") print(plan);
  file.write(plan.dump(2) + "\n");
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("What a question about a scene needs, and what is left out by which rule.", "plan");
  Options options;
  options.question.want = {"acceleration"};
  add_scene(app, options.scene, options.read)->required();
  app.add_option("--want", options.question.want,
                 "any of acceleration, inverse, diagonal, log_det, mass, operational")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(
          CLI::IsMember({"acceleration", "inverse", "diagonal", "log_det", "mass", "operational"}))
      ->capture_default_str();
  options.question.add_to(app);
  app.add_option("--tolerance", options.tolerance,
                 "relative error that is allowed: which precision")
      ->check(positive());
  app.add_option("--random", options.random, "states that the precision is for")
      ->check(number_of_states())
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of these states")
      ->check(any_seed())
      ->capture_default_str();
  app.add_flag("--frames", options.frames,
               "list the frames that --site knows: sites, bodies, links");
  app.add_option("--json", options.json_file, std::string("the plan: ") + json_help);
  return run_program(app, argc, argv, [&] { return run(options); });
}
