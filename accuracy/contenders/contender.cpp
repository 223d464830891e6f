#include "accuracy/contenders/contender.hpp"

#include <optional>

#include "accuracy/measures/real.hpp"
#include "algorithms/dynamics/plan.hpp"
#include "algorithms/study/solver_engine.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/mujoco_solver.hpp"

namespace kalmarm {
namespace {

[[noreturn]] void unknown_variant(const Contender& by, const std::string& why) {
  std::string names = mujoco_variant;
  for (const auto& variant : all_variants<double>()) names += ", " + variant.name;
  throw InputError("variant '" + by.variant + "' " + why + " (known: " + names + ")");
}

// What the registry says of the variant; null: it is MuJoCo, or unknown.
std::optional<VariantTraits> traits_of(const std::string& variant) {
  for (const auto& one : all_variants<double>())
    if (one.name == variant) return one.traits;
  return std::nullopt;
}

bool is_fast(const std::string& variant) {
  const std::optional<VariantTraits> traits = traits_of(variant);
  return traits && traits->kind == VariantKind::ladder;
}

}  // namespace

template <class T>
std::unique_ptr<Solver<T>> make_contender(const Contender& by, const Scene& scene,
                                          const Model<T>& model) {
  if (by.variant == mujoco_variant) {
    if constexpr (std::is_same_v<T, double>)
      return std::make_unique<MujocoSolver>(mujoco_of(scene));
    else
      unknown_variant(by, "has no precision " + by.precision);
  }
  if (auto solver = make_solver<T>(by.variant, model)) return solver;
  for (const auto& variant : all_variants<T>())
    if (variant.name == by.variant)
      throw InputError("variant '" + by.variant +
                       "' takes other mechanisms alone, such as chains of bodies with mass and "
                       "three moments of inertia");
  for (const auto& variant : all_variants<double>())
    if (variant.name == by.variant) unknown_variant(by, "has no precision " + by.precision);
  unknown_variant(by, "is unknown");
}

template <class T>
Dynamics<T> make_robot(const Contender& by, const Scene& scene, const DynamicsOptions& asked) {
  if constexpr (std::is_floating_point_v<T>)
    if (is_fast(by.variant))  // truth is of the robot whose parameters are rounded to T
      return Dynamics<T>(plain(scene.model.template cast<T>().template cast<double>()), asked);
  return Dynamics<T>(plain(scene.model), asked, engines_by<T>([by, scene](const Model<T>& part) {
                       return make_contender<T>(by, scene, part);
                     }));
}

DynamicsOptions asked_of(const Contender& by, const QuestionOptions& asked,
                         const Question& question) {
  const std::optional<VariantTraits> traits = traits_of(by.variant);
  const bool fast = is_fast(by.variant);
  DynamicsOptions out{.tolerance = fast ? traits->tolerance : std::nullopt,
                      .question = question,
                      .rules = rules_of(asked)};
  if (by.variant == mujoco_variant) {
    if (!question.locked.empty()) throw InputError("variant 'MuJoCo' cannot lock joints");
    if (question.want.contains(Want::log_det))
      throw InputError("variant 'MuJoCo' has no log det M");
    out.rules.clear();
  }
  const std::set<Rule> able =
      fast ? rules_for(out.tolerance.value_or(default_tolerance<double>)) : model_rules();
  std::erase_if(out.rules, [&](Rule rule) { return !able.contains(rule); });
  return out;
}

template std::unique_ptr<Solver<float>> make_contender(const Contender&, const Scene&,
                                                       const Model<float>&);
template std::unique_ptr<Solver<double>> make_contender(const Contender&, const Scene&,
                                                        const Model<double>&);
template std::unique_ptr<Solver<Real>> make_contender(const Contender&, const Scene&,
                                                      const Model<Real>&);
template Dynamics<float> make_robot(const Contender&, const Scene&, const DynamicsOptions&);
template Dynamics<double> make_robot(const Contender&, const Scene&, const DynamicsOptions&);
template Dynamics<Real> make_robot(const Contender&, const Scene&, const DynamicsOptions&);

}  // namespace kalmarm
